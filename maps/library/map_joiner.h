// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

#include "maps/library/signpost_redirection.h"
#include "maps/storage/database.h"
#include "maps/storage/map_record.h"
#include "maps/storage/scene_tools.h"

namespace docent::maps {

// Stores that two maps were joined, and removes maps from a library. The functions run in a transaction of
// the caller, and throw docent::Error.
class MapJoiner {
 public:
  // clock gives the time of modification. All references must outlive this.
  MapJoiner(const Database& database, const SignpostRedirection& signposts,
            const std::function<WallTime()>& clock)
      : database_(database), signposts_(signposts), clock_(clock) {}

  // Joins two maps and redirects everything that refers to the removed one; see Library::Join.
  void Join(const JoinRecord& record) const;
  // Removes a map that was joined into another one before either was saved. Returns false if it no longer
  // exists.
  bool RemoveJoined(std::uint64_t key, const SignpostTarget& into) const;
  // Removes a map with its content, also from the tours; signposts to it stay as they are.
  void Remove(std::uint64_t key) const;

 private:
  const Database& database_;
  const SignpostRedirection& signposts_;
  const std::function<WallTime()>& clock_;
};

}  // namespace docent::maps

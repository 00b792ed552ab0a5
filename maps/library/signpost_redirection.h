// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "maps/storage/database.h"
#include "maps/storage/map_record.h"
#include "maps/storage/scene_tools.h"

namespace docent::maps {

// Finds and redirects the signposts of a library when a map gets another name, is removed, or is joined into
// another one. The functions run in a transaction of the caller, and throw docent::Error.
class SignpostRedirection {
 public:
  // clock gives the time of modification. All references must outlive this.
  SignpostRedirection(const Database& database, const SceneTools& scenes,
                      const std::function<WallTime()>& clock)
      : database_(database), scenes_(scenes), clock_(clock) {}

  // The text of a map's scene with other targets; empty if none changes, or the scene cannot be read and so
  // leads nowhere.
  std::optional<std::string> RetargetIn(const MapInfo& info, const Retarget& retarget) const;
  // Makes all signposts to the map `from` lead to another map or, with an empty target, nowhere; also those
  // that undo and redo would restore. The maps with the keys `except` are left out. `refusal` says what
  // cannot be done where the policy forbids it; if it is empty, the policy does not matter, because the
  // signposts lead to the same place as before. It never matters for what undo would restore.
  void Redirect(const MapInfo& from, const SignpostTarget& into, const std::vector<std::uint64_t>& except,
                const std::string& refusal) const;

 private:
  // The same for what the changes of the scene that can be undone restore.
  std::optional<std::string> RetargetInHistory(const MapInfo& info, const Retarget& retarget) const;

  const Database& database_;
  const SceneTools& scenes_;
  const std::function<WallTime()>& clock_;
};

}  // namespace docent::maps

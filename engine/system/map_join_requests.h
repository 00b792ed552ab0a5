// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "engine/recognition/place_index.h"
#include "engine/system/mapping_thread.h"
#include "engine/system/system_state.h"

namespace docent::engine {

// Joins a map that was started where the camera was lost to the map that the camera returned to
// (map_joining.h defines which maps show the same place). The mapper joins them between two keyframes of the
// active map; ids and coordinates of the active map are kept, so that tracking continues as after loop
// closing. With the system's lock held.
class MapJoinRequests {
 public:
  // attempt_growth: a refused pair is compared again after at least this many new keyframes.
  MapJoinRequests(std::size_t attempt_growth, SystemState* state, PlaceIndex* index, MappingThread* mapping)
      : attempt_growth_(attempt_growth), state_(*state), index_(*index), mapping_(*mapping) {}

  // To be called whenever a map was entered or extended.
  void Request(const KnownMap& into);
  // A person asks for `from` to be joined into `into`. While another pair is being compared, this one waits.
  void Request(KnownMap* from, const KnownMap& into);
  enum class Answer { kAwaited, kOutdated, kChangedMeanwhile };
  // kChangedMeanwhile: one of the maps changed after the request, so that the mapper must continue with the
  // map as it was.
  Answer Check(const MappingThread::MapperUpdate::Join& update, const KnownMap& into) const;
  // Takes over the result of the pending request.
  void Handle(const MapJoinAttempt& attempt, KnownMap* into);
  // The mapper begins with another snapshot, whatever it had joined.
  void Cancel() { pending_.reset(); }
  // Whether this map is being compared with the active one, or joined into it.
  bool IsJoining(std::uint64_t key) const { return pending_ && pending_->from == key; }

 private:
  struct Pending {
    std::uint64_t number = 0, from = 0;
    std::shared_ptr<const MapSnapshot> snapshot;
  };

  std::size_t attempt_growth_;
  SystemState& state_;
  PlaceIndex& index_;
  MappingThread& mapping_;
  std::optional<Pending> pending_;
  std::uint64_t requested_ = 0;  // number of the last request
};

}  // namespace docent::engine

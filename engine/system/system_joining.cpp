// SPDX-License-Identifier: Apache-2.0
// Joins a map that was started where the camera was lost to the map that the camera returned to
// (map_joining.h defines which maps show the same place). The mapper joins them between two keyframes of the
// active map; ids and coordinates of the active map are kept, so that tracking continues as after loop
// closing.
#include <algorithm>
#include <utility>

#include "engine/system/system.h"

namespace docent::engine {

namespace {

std::size_t KeyFramesOf(const MapSnapshot& a, const MapSnapshot& b) {
  return a.keyframes.size() + b.keyframes.size();
}

// Number of keyframes of both maps from which they are compared again. The time of a comparison grows with
// this number: with a quarter more each time, all comparisons together take at most five times as long as the
// last one. With fewer than `fewest` new keyframes there is hardly anything new to compare.
std::size_t CompareAgainAt(std::size_t keyframes, std::size_t fewest) {
  return keyframes + std::max(fewest, keyframes / 4);
}

}  // namespace

// To be called whenever a map was entered or extended.
void System::RequestJoin(const MapState& into) {
  if (joining_ || active_key_ != into.key || !into.MayBeJoined()) return;
  for (const auto& [key, map] : maps_) {
    if (map.join_with != into.key || !map.MayBeJoined() ||
        KeyFramesOf(*into.snapshot, *map.snapshot) < map.join_at)
      continue;
    joining_ = Joining{++joins_requested_, key, map.snapshot};
    mapping_.Join(into.key, joining_->number, map.snapshot);
    Emit(LastTime(), into.key, JoinRequested{key});
    return;
  }
}

// Whether the answer belongs to the last request and both maps are unchanged since then. Otherwise the mapper
// continues with the map as it was.
bool System::IsAwaited(const MappingThread::MapperUpdate::Join& update, const MapState& into) {
  if (!joining_ || joining_->number != update.number) return false;
  const MapState& from = maps_.at(joining_->from);
  if (!update.attempt.joined ||
      (into.MayBeJoined() && from.MayBeJoined() && from.snapshot == joining_->snapshot))
    return true;
  ActivateNow(into);
  return false;
}

void System::HandleJoinAttempt(const MapJoinAttempt& attempt, MapState* into) {
  MapState& from = maps_.at(joining_->from);
  joining_.reset();
  if (!attempt.joined) {
    if (attempt.overlap.outcome == MapOverlap::Outcome::kInterrupted) return;
    from.join_at =
        CompareAgainAt(KeyFramesOf(*into->snapshot, *from.snapshot), options_.provisional.keyframes);
    JoinRefused event{from.key, attempt.refusal, attempt.overlap};
    event.overlap.candidates.clear();
    Emit(LastTime(), into->key, std::move(event));
    return;
  }
  from.joined_into = into->key;
  index_.RemoveMap(from.key);
  for (auto& [key, map] : maps_) {
    if (map.Exists() && key != into->key && map.join_with == from.key) map.join_with = into->key;
  }
  Emit(LastTime(), into->key, MapsJoined{from.key, std::make_shared<const JoinedMap>(*attempt.joined)});
}

}  // namespace docent::engine

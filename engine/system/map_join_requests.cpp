// SPDX-License-Identifier: Apache-2.0
#include "engine/system/map_join_requests.h"

#include <algorithm>
#include <utility>

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

void MapJoinRequests::Request(const KnownMap& into) {
  if (pending_ || state_.active_key != into.key || !into.MayBeJoined()) return;
  for (const auto& [key, map] : state_.maps) {
    if (map.join_with != into.key || !map.MayBeJoined() ||
        KeyFramesOf(*into.snapshot, *map.snapshot) < map.join_at)
      continue;
    pending_ = Pending{++requested_, key, map.snapshot};
    mapping_.Join(into.key, pending_->number, map.snapshot);
    state_.Emit(state_.LastTime(), into.key, JoinRequested{key});
    return;
  }
}

void MapJoinRequests::Request(KnownMap* from, const KnownMap& into) {
  from->join_with = into.key;
  from->join_at = 0;
  from->join_asked = true;
  Request(into);
}

MapJoinRequests::Answer MapJoinRequests::Check(const MappingThread::MapperUpdate::Join& update,
                                               const KnownMap& into) const {
  if (!pending_ || pending_->number != update.number) return Answer::kOutdated;
  const KnownMap& from = state_.maps.at(pending_->from);
  const bool unchanged = into.MayBeJoined() && from.MayBeJoined() && from.snapshot == pending_->snapshot;
  return !update.attempt.joined || unchanged ? Answer::kAwaited : Answer::kChangedMeanwhile;
}

void MapJoinRequests::Handle(const MapJoinAttempt& attempt, KnownMap* into) {
  const Pending request = *std::exchange(pending_, std::nullopt);
  KnownMap& from = state_.maps.at(request.from);
  if (!attempt.joined) {
    if (attempt.overlap.outcome == MapOverlap::Outcome::kInterrupted) return;
    from.join_at = CompareAgainAt(attempt.keyframes, attempt_growth_);
    JoinRefused event{from.key, attempt.refusal, attempt.overlap, std::exchange(from.join_asked, false)};
    event.overlap.candidates.clear();
    state_.Emit(state_.LastTime(), into->key, std::move(event));
    return;
  }
  from.JoinInto(into->key);
  index_.RemoveMap(from.key);
  for (auto& [key, map] : state_.maps) {
    if (map.Exists() && key != into->key && map.join_with == from.key) map.join_with = into->key;
  }
  state_.Emit(state_.LastTime(), into->key,
              MapsJoined{from.key, std::make_shared<const JoinedMap>(*attempt.joined)});
}

}  // namespace docent::engine

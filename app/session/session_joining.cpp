// SPDX-License-Identifier: Apache-2.0
// Joins a map that was started where the camera was lost to the map that the camera returned to
// (engine/mapping/map_joining.h defines which maps show the same place). The mapper joins them between two
// keyframes of the active map; ids and coordinates of the active map are kept, so that tracking continues as
// after loop closing. Only maps with the open policy are joined automatically.
#include <algorithm>
#include <string>
#include <utility>

#include "app/session/joined_scenes.h"
#include "app/session/session.h"

namespace docent::app {

namespace {

bool MayBeJoined(const SessionMap& map) {
  return map.Exists() && map.snapshot && map.snapshot->HasFinitePoints() && map.policy == maps::Policy::kOpen;
}

std::size_t KeyFramesOf(const SessionMap& a, const SessionMap& b) {
  return a.snapshot->keyframes.size() + b.snapshot->keyframes.size();
}

// Number of keyframes of both maps from which they are compared again. The time of a comparison extended with
// this number: with a quarter more each time, all comparisons together take at most five times as long as the
// last one. With fewer than `fewest` new keyframes there is hardly anything new to compare.
std::size_t CompareAgainAt(std::size_t keyframes, std::size_t fewest) {
  return keyframes + std::max(fewest, keyframes / 4);
}

}  // namespace

// To be called whenever a map was entered or extended.
void Session::RequestJoin(const SessionMap& into) {
  if (joining_ || active_key_ != into.key || !MayBeJoined(into)) return;
  for (const auto& [key, map] : maps_) {
    if (map.join_with != into.key || !MayBeJoined(map) || KeyFramesOf(into, map) < map.join_at) continue;
    joining_ = Joining{++joins_requested_, key, map.snapshot};
    mapping_.Join(into.key, joining_->number, map.snapshot);
    if (saver_) saver_->InterruptMaintenance();  // maintenance may be adjusting this map
    return;
  }
}

// Whether the answer belongs to the last request and both maps are unchanged since then. Otherwise the mapper
// continues with the map as it was.
bool Session::IsAwaited(const MappingThread::MapperUpdate::Join& update, const SessionMap& into) {
  if (!joining_ || joining_->number != update.number) return false;
  const SessionMap& from = maps_.at(joining_->from);
  if (!update.attempt.joined ||
      (MayBeJoined(into) && MayBeJoined(from) && from.snapshot == joining_->snapshot))
    return true;
  ExtendMap(into);
  return false;
}

void Session::HandleJoinAttempt(const engine::MapJoinAttempt& attempt, SessionMap* into) {
  SessionMap& from = maps_.at(joining_->from);
  joining_.reset();
  const Timestamp now = LastTime();
  const std::string both = "maps " + into->name + " and " + from.name;
  if (attempt.joined) {
    AbsorbMap(&from, *attempt.joined, into);
    const std::string sentence = both + " were joined";
    AddEvent(now, "map",
             sentence + ": " + std::to_string(attempt.joined->points_merged) +
                 " pairs of duplicate points were fused");
    for (Camera& camera : cameras_) Advise(&camera, sentence);
  } else if (attempt.overlap.outcome != engine::MapOverlap::Outcome::kInterrupted) {
    from.join_at = CompareAgainAt(KeyFramesOf(*into, from), options_.provisional_keyframes);
    AddEvent(now, "map", both + " were not joined: " + attempt.refusal);
  }
}

// `into` already has the joined snapshot. Edits in `from` can no longer be undone, as its content was moved.
void Session::AbsorbMap(SessionMap* from, const engine::JoinedMap& joined, SessionMap* into) {
  auto scene = std::make_shared<content::Scene>(*into->scene);
  MergeScene(*from->scene, into->name, from->name, joined, scene.get());
  into->scene = std::move(scene);
  into->joined_keys.push_back(from->key);
  into->joined_keys.insert(into->joined_keys.end(), from->joined_keys.begin(), from->joined_keys.end());
  from->joined_into = into->key;
  index_.RemoveMap(from->key);
  for (auto& [key, map] : maps_) {
    if (!map.Exists() || key == into->key) continue;
    if (map.join_with == from->key) map.join_with = into->key;
    auto other = std::make_shared<content::Scene>(*map.scene);
    if (maps::MayChangeContent(map.policy) && RedirectSceneSignposts(from->name, into->name, other.get()))
      map.scene = std::move(other);
  }
}

}  // namespace docent::app

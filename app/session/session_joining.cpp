// SPDX-License-Identifier: Apache-2.0
// How a map that was begun where the camera was lost becomes a part of the map that the camera went back to
// (engine/mapping/map_joining.h says which maps show one place). The mapper joins them while the map that the
// camera is in rests; its ids and coordinates stay, so that the track goes on as after a loop. Only maps that
// anybody may change in every way are joined without being asked to.
#include <algorithm>
#include <string>
#include <utility>

#include "app/session/joined_scenes.h"
#include "app/session/session.h"

namespace docent::app {

namespace {

bool MayBeJoined(const SessionMap& map) {
  return map.IsActive() && map.snapshot && map.snapshot->HasFinitePoints() &&
         map.policy == maps::Policy::kOpen;
}

std::size_t KeyFramesOf(const SessionMap& a, const SessionMap& b) {
  return a.snapshot->keyframes.size() + b.snapshot->keyframes.size();
}

// From how many keyframes on two maps are compared again. The time of a comparison grows with their number:
// a quarter more each time, and all of them together take at most five times as long as the last one. Below
// `fewest` more there is hardly anything new to compare.
std::size_t CompareAgainAt(std::size_t keyframes, std::size_t fewest) {
  return keyframes + std::max(fewest, keyframes / 4);
}

}  // namespace

// Whenever a map is entered or has grown.
void Session::AskToJoin(const SessionMap& into) {
  if (joining_ || extended_key_ != into.key || !MayBeJoined(into)) return;
  for (const auto& [key, map] : maps_) {
    if (map.join_with != into.key || !MayBeJoined(map) || KeyFramesOf(into, map) < map.join_at) continue;
    joining_ = Joining{++joins_asked_, key, map.snapshot};
    mapping_.Join(into.key, joining_->number, map.snapshot);
    if (saver_) saver_->InterruptMaintenance();  // it may be this map's
    return;
  }
}

// Whether the answer is to what was asked last, of maps that are still as they were. If they are not, the
// mapper goes on with the map as it was.
bool Session::Expects(const MappingThread::MapperUpdate::Join& news, const SessionMap& into) {
  if (!joining_ || joining_->number != news.number) return false;
  const SessionMap& from = maps_.at(joining_->from);
  if (!news.attempt.joined || (MayBeJoined(into) && MayBeJoined(from) && from.snapshot == joining_->snapshot))
    return true;
  ExtendMap(into);
  return false;
}

void Session::EndJoining(const engine::MapJoinAttempt& attempt, SessionMap* into) {
  SessionMap& from = maps_.at(joining_->from);
  joining_.reset();
  const Timestamp now = LastTime();
  const std::string both = "maps " + into->name + " and " + from.name;
  if (attempt.joined) {
    AbsorbMap(&from, *attempt.joined, into);
    const std::string sentence = both + " were joined";
    AddEvent(now, "map",
             sentence + ": " + std::to_string(attempt.joined->points_merged) + " points became one each");
    for (Camera& camera : cameras_) Advise(&camera, sentence);
  } else if (attempt.overlap.verdict != engine::MapOverlap::RelocalizationResult::kInterrupted) {
    from.join_at = CompareAgainAt(KeyFramesOf(*into, from), options_.probation_keyframes);
    AddEvent(now, "map", both + " stay two, because " + attempt.refusal);
  }
}

// `into` has the joined map already. What stands in `from` can be undone no more, as it stands elsewhere now.
void Session::AbsorbMap(SessionMap* from, const engine::JoinedMap& joined, SessionMap* into) {
  auto scene = std::make_shared<content::Scene>(*into->scene);
  TakeInScene(*from->scene, into->name, from->name, joined, scene.get());
  into->scene = std::move(scene);
  into->holds.push_back(from->key);
  into->holds.insert(into->holds.end(), from->holds.begin(), from->holds.end());
  from->joined_into = into->key;
  index_.RemoveMap(from->key);
  for (auto& [key, map] : maps_) {
    if (!map.IsActive() || key == into->key) continue;
    if (map.join_with == from->key) map.join_with = into->key;
    auto other = std::make_shared<content::Scene>(*map.scene);
    if (maps::MayChangeContent(map.policy) && RedirectSignpostsIn(from->name, into->name, other.get()))
      map.scene = std::move(other);
  }
}

}  // namespace docent::app

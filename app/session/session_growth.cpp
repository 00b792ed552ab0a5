// SPDX-License-Identifier: Apache-2.0
// How a session's maps are entered, how far they may grow, and when a start is taken back.
#include <algorithm>
#include <string>
#include <utility>

#include "app/files/text_file.h"
#include "app/session/session.h"

namespace docent::app {

void Session::EnterMap(Camera* camera, std::uint64_t key, Timestamp time) {
  const std::uint64_t before = std::exchange(camera->map_key, key);
  const SessionMap& map = maps_.at(key);
  AddEvent(time, "map", "entered " + map.name);
  PinMapsInUse();
  ExpectNeighbours(map);
  if (saver_) saver_->InterruptMaintenance();  // it may be this map's
  // The others give up where they are looking and come (ptamm §3.3).
  for (Camera& other : cameras_) {
    if (other.map_key == key) continue;
    other.map_key = key;
    other.lost_since.reset();
    other.order = Camera::Order::kGo;
  }
  if (!options_.may_write || extended_key_ == key) return;
  // The map before rests now: it is saved as it stands, and grows again when somebody comes back to it.
  if (const auto found = maps_.find(before); found != maps_.end() && found->second.IsActive()) {
    SessionMap& left = found->second;
    left.on_probation = false;
    SaveMap(&left, time);
    if (left.after_loss && !(left.snapshot && left.snapshot->HasFinitePoints())) {
      left.discarded = true;
      index_.RemoveMap(before);
      AddEvent(time, "map", "discarded " + left.name + ": the camera was found in " + map.name);
    } else if (left.after_loss) {
      left.join_with = key;
    }
  }
  ExtendMap(map);
  AskToJoin(map);
}

bool Session::MayExtend(const SessionMap& map, const engine::Rigid3& camera_from_map) const {
  return options_.may_write && map.IsActive() &&
         maps::KeyFrameAllowed(map.policy, map.bounds, camera_from_map.OriginInSource());
}

void Session::WatchProbation(Camera* camera, const engine::TrackedFrame& frame) {
  const auto found = maps_.find(camera->map_key);
  if (found == maps_.end()) return;
  SessionMap& map = found->second;
  const Timestamp now = frame.frame.time;
  if (options_.may_write && map.snapshot && !map.snapshot->HasFinitePoints()) {
    // Directions alone are soon had again.
    if (camera->lost_since && now - *camera->lost_since > options_.first_image_loss)
      Discard(map.key, now, "its track was lost before it knew depth");
    return;
  }
  if (!map.on_probation) return;
  if (frame.map_key == map.key) map.start_watch.Add(frame);
  const auto fault = map.start_watch.Fault();
  // What was saved or furnished is kept, whatever becomes of it.
  const bool replaceable = !map.saved_snapshot && map.scene->entities.empty();
  if (fault && replaceable) {
    Discard(map.key, now, "its depth was wrong: " + *fault);
    return;
  }
  if (!camera->lost_since) {
    if (now - map.started > options_.probation ||
        map.snapshot->keyframes.size() >= options_.probation_keyframes)
      map.on_probation = false;
    return;
  }
  if (now - *camera->lost_since <= options_.probation_loss) return;
  if (!replaceable) {
    map.on_probation = false;
    return;
  }
  Discard(map.key, now,
          "its track was lost " + FormatNumber(ToSeconds(*camera->lost_since - map.started), 3) +
              " s after the start, with " + std::to_string(map.snapshot->keyframes.size()) + " keyframes");
}

// A camera that is lost where no map explains what it sees goes on in a new one.
void Session::WatchLoss(Camera* camera, const engine::TrackedFrame& frame) {
  if (!options_.may_write || !options_.new_map_when_lost || !camera->lost_since || association_.AnyTracked())
    return;
  const auto found = maps_.find(camera->map_key);
  // A map that somebody stopped, or that may not grow, is not left by itself.
  if (found == maps_.end() || found->second.on_probation || extended_key_ != found->first) return;
  const Timestamp now = frame.frame.time;
  if (now - *camera->lost_since <= options_.lost_patience) return;
  if (frame.verdict.doubt == engine::RejectionReason::kUnconfirmed) return;  // it is about to be found
  const std::string before = found->second.name;
  const std::string name = FreeMapName(before);
  Apply(NewMap{name}, frame);
  SessionMap& map = *FindByName(name);
  map.after_loss = true;
  camera->order = Camera::Order::kStartAfterLoss;
  AddEvent(now, "map", "began " + name + ": the camera was lost in " + before);
}

// "Hall" becomes "Hall 2", and that "Hall 3".
std::string Session::FreeMapName(const std::string& name) const {
  std::string stem = name;
  const std::size_t space = name.rfind(' ');
  if (space != std::string::npos && space + 1 < name.size() &&
      name.find_first_not_of("0123456789", space + 1) == std::string::npos)
    stem = name.substr(0, space);
  for (int number = 2;; ++number) {
    const std::string candidate = stem + " " + std::to_string(number);
    const bool taken = std::any_of(maps_.begin(), maps_.end(), [&](const auto& entry) {
      return entry.second.IsActive() && entry.second.name == candidate;
    });
    if (!taken) return candidate;
  }
}

void Session::Discard(std::uint64_t key, Timestamp time, const std::string& reason) {
  SessionMap& map = maps_.at(key);
  map.discarded = true;
  index_.RemoveMap(key);
  AddEvent(time, "map", "discarded " + map.name + ": " + reason);
  SessionMap& next = AddMap(map.name);
  next.after_loss = map.after_loss;
  // What was placed in the false start has lost its ground with it.
  for (const content::Entity& entity : map.scene->entities) {
    AddEvent(time, "warning", "'" + entity.name + "' went with the discarded map");
  }
  AssignMapper(next.key, nullptr);
  association_.Begin(next.key);
  for (Camera& camera : cameras_) {
    if (camera.map_key != key) continue;
    camera.map_key = next.key;
    camera.order = !camera.began     ? Camera::Order::kGo
                   : next.after_loss ? Camera::Order::kStartAfterLoss
                                     : Camera::Order::kStart;
    camera.lost_since.reset();
  }
}

}  // namespace docent::app

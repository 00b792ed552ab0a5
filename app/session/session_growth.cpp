// SPDX-License-Identifier: Apache-2.0
// How maps are entered, which frames may extend them, and when a false initialization is discarded.
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
  if (saver_) saver_->InterruptMaintenance();  // maintenance may be adjusting this map
  // The other cameras abandon their search and enter this map (ptamm §3.3).
  for (Camera& other : cameras_) {
    if (other.map_key == key) continue;
    other.map_key = key;
    other.lost_since.reset();
    other.order = Camera::Order::kEnter;
  }
  if (!options_.may_write || active_key_ == key) return;
  // The previous map becomes idle: it is saved, and extended again when a camera returns to it.
  if (const auto found = maps_.find(before); found != maps_.end() && found->second.Exists()) {
    SessionMap& left = found->second;
    left.provisional = false;
    SaveMap(&left, time);
    if (left.after_loss && !(left.snapshot && left.snapshot->HasFinitePoints())) {
      left.discarded = true;
      index_.RemoveMap(before);
      AddEvent(time, "map", "discarded " + left.name + ": the camera relocalized in " + map.name);
    } else if (left.after_loss) {
      left.join_with = key;
    }
  }
  ExtendMap(map);
  RequestJoin(map);
}

bool Session::MayExtend(const SessionMap& map, const engine::Rigid3& camera_from_map) const {
  return options_.may_write && map.Exists() &&
         maps::KeyFrameAllowed(map.policy, map.bounds, camera_from_map.OriginInSource());
}

void Session::CheckProvisionalMap(Camera* camera, const engine::TrackedFrame& frame) {
  const auto found = maps_.find(camera->map_key);
  if (found == maps_.end()) return;
  SessionMap& map = found->second;
  const Timestamp now = frame.frame.time;
  if (options_.may_write && map.snapshot && !map.snapshot->HasFinitePoints()) {
    // A map without finite points is quickly made again.
    if (camera->lost_since && now - *camera->lost_since > options_.panorama_loss_time)
      Discard(map.key, now, "tracking was lost before the map had finite points");
    return;
  }
  if (!map.provisional) return;
  if (frame.map_key == map.key) map.initialization_monitor.Add(frame);
  const auto fault = map.initialization_monitor.Fault();
  // A map that was saved or that has content is kept in any case.
  const bool replaceable = !map.saved_snapshot && map.scene->entities.empty();
  if (fault && replaceable) {
    Discard(map.key, now, "its depth was wrong: " + *fault);
    return;
  }
  if (!camera->lost_since) {
    if (now - map.started > options_.provisional_time ||
        map.snapshot->keyframes.size() >= options_.provisional_keyframes)
      map.provisional = false;
    return;
  }
  if (now - *camera->lost_since <= options_.provisional_loss_time) return;
  if (!replaceable) {
    map.provisional = false;
    return;
  }
  Discard(map.key, now,
          "tracking was lost " + FormatNumber(ToSeconds(*camera->lost_since - map.started), 3) +
              " s after initialization, with " + std::to_string(map.snapshot->keyframes.size()) +
              " keyframes");
}

// Starts a new map for a camera that is lost and recognises no map.
void Session::CheckLoss(Camera* camera, const engine::TrackedFrame& frame) {
  if (!options_.may_write || !options_.new_map_when_lost || !camera->lost_since || association_.AnyTracked())
    return;
  const auto found = maps_.find(camera->map_key);
  // A map that the user stopped, or that may not be extended, is not left automatically.
  if (found == maps_.end() || found->second.provisional || active_key_ != found->first) return;
  const Timestamp now = frame.frame.time;
  if (now - *camera->lost_since <= options_.lost_time_before_new_map) return;
  if (frame.relocalization.rejection == engine::RejectionReason::kUnconfirmed)
    return;  // relocalization is imminent
  const std::string before = found->second.name;
  const std::string name = FreeMapName(before);
  Apply(NewMap{name}, frame);
  SessionMap& map = *FindByName(name);
  map.after_loss = true;
  camera->order = Camera::Order::kStartAfterLoss;
  AddEvent(now, "map", "began " + name + ": the camera was lost in " + before);
}

// "Hall" becomes "Hall 2", and "Hall 2" becomes "Hall 3".
std::string Session::FreeMapName(const std::string& name) const {
  std::string stem = name;
  const std::size_t space = name.rfind(' ');
  if (space != std::string::npos && space + 1 < name.size() &&
      name.find_first_not_of("0123456789", space + 1) == std::string::npos)
    stem = name.substr(0, space);
  for (int number = 2;; ++number) {
    const std::string candidate = stem + " " + std::to_string(number);
    const bool taken = std::any_of(maps_.begin(), maps_.end(), [&](const auto& entry) {
      return entry.second.Exists() && entry.second.name == candidate;
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
  // Content of the false initialization has lost its anchor.
  for (const content::Entity& entity : map.scene->entities) {
    AddEvent(time, "warning", "'" + entity.name + "' was removed with the discarded map");
  }
  AssignMapper(next.key, nullptr);
  association_.Begin(next.key);
  for (Camera& camera : cameras_) {
    if (camera.map_key != key) continue;
    camera.map_key = next.key;
    camera.order = !camera.started_map ? Camera::Order::kEnter
                   : next.after_loss   ? Camera::Order::kStartAfterLoss
                                       : Camera::Order::kStart;
    camera.lost_since.reset();
  }
}

}  // namespace docent::app

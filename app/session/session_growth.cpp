// SPDX-License-Identifier: Apache-2.0
// How a session's maps are entered, how far they may grow, and when a start is taken back.
#include <string>
#include <utility>

#include "app/files/text_file.h"
#include "app/session/session.h"

namespace docent::app {

void Session::EnterMap(Camera* camera, std::uint64_t key, Timestamp time) {
  const std::uint64_t before = std::exchange(camera->map_key, key);
  const SessionMap& map = maps_.at(key);
  AddEvent(time, "map", "entered " + map.name);
  HoldMapsInUse();
  ExpectNeighbours(map);
  if (saver_) saver_->InterruptUpkeep();  // it may be this map's
  // The others give up where they are looking and come (ptamm §3.3).
  for (Camera& other : cameras_) {
    if (other.map_key == key) continue;
    other.map_key = key;
    other.lost_since.reset();
    other.order = Camera::Order::kGo;
  }
  if (!options_.may_write || growing_key_ == key) return;
  // The map before rests now: it is saved as it stands, and grows again when somebody comes back to it.
  if (const auto found = maps_.find(before); found != maps_.end() && !found->second.discarded) {
    found->second.on_probation = false;
    SaveMap(&found->second, time);
  }
  GrowOn(map);
}

bool Session::MayGrow(const SessionMap& map, const engine::Rigid3& camera_from_map) const {
  return options_.may_write && !map.discarded &&
         maps::KeyFrameAllowed(map.policy, map.bounds, camera_from_map.OriginInSource());
}

void Session::WatchProbation(Camera* camera, const engine::TrackedFrame& frame) {
  const auto found = maps_.find(camera->map_key);
  if (found == maps_.end()) return;
  SessionMap& map = found->second;
  const Timestamp now = frame.frame.time;
  if (options_.may_write && map.snapshot && !map.snapshot->HasFinitePoints()) {
    // Directions alone are soon had again.
    const bool one_picture = map.snapshot->keyframes.size() == 1;
    if (camera->lost_since &&
        now - *camera->lost_since > (one_picture ? options_.first_picture_loss : options_.probation_loss))
      Discard(map.key, now, "its track was lost before it knew depth");
    return;
  }
  if (!map.on_probation) return;
  if (map.snapshot->keyframes.size() >= options_.probation_keyframes ||
      (!camera->lost_since && now - map.started > options_.probation)) {
    map.on_probation = false;
    return;
  }
  if (!camera->lost_since || now - *camera->lost_since <= options_.probation_loss) return;
  if (*camera->lost_since - map.started > options_.probation) {
    map.on_probation = false;
    return;
  }
  Discard(map.key, now,
          "its track was lost " + FormatNumber(ToSeconds(*camera->lost_since - map.started), 3) +
              " s after the start, with " + std::to_string(map.snapshot->keyframes.size()) + " keyframes");
}

void Session::Discard(std::uint64_t key, Timestamp time, const std::string& reason) {
  SessionMap& map = maps_.at(key);
  map.discarded = true;
  index_.RemoveMap(key);
  AddEvent(time, "map", "discarded " + map.name + ": " + reason);
  SessionMap& next = AddMap(map.name);
  // What was placed in the false start has lost its ground with it.
  for (const content::Entity& entity : map.scene->entities) {
    AddEvent(time, "warning", "'" + entity.name + "' went with the discarded map");
  }
  growing_key_ = next.key;
  mapping_.Adopt(next.key, nullptr);
  association_.Begin(next.key);
  for (Camera& camera : cameras_) {
    if (camera.map_key != key) continue;
    camera.map_key = next.key;
    camera.order = camera.began ? Camera::Order::kStart : Camera::Order::kGo;
    camera.lost_since.reset();
  }
}

}  // namespace docent::app

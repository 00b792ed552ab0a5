// SPDX-License-Identifier: Apache-2.0
#include "engine/system/map_policy.h"

#include <algorithm>
#include <utility>

namespace docent::engine {

void MapPolicy::HandleResult(std::size_t index, TrackedFrame* frame) {
  SystemCamera* const camera = &state_.cameras[index];
  const Timestamp now = camera->last_time = frame->frame.time;
  // The frame began before the order, so that its pose or its loss is not one in the map that was ordered.
  const bool is_outdated = camera->assignment.has_order();
  if (!HasPose(frame->state)) {
    state_.association.SetLost(index);
  } else if (const auto map = state_.maps.find(frame->map_key);
             is_outdated || map == state_.maps.end() || !map->second.Exists() ||
             !state_.association.SetTracked(index, frame->map_key)) {
    state_.association.SetLost(index);
    RejectPose(index, frame);
  }
  if (is_outdated) return;
  const bool has_pose = HasPose(frame->state);
  if (has_pose && frame->map_key != camera->assignment.map()) {
    EnterTrackedMap(index, frame->map_key, now);
  } else if (frame->state == TrackingState::kRelocalized) {
    state_.Emit(now, frame->map_key, Relocalized{}, index);
  }
  if (has_pose) {
    camera->assignment.SetTracked();
    calibrations_.AddFrame(index, *frame);
  } else if (state_.association.AnyTracked()) {
    // A camera that looks elsewhere says nothing of the map. Its loss counts from when all are lost.
    camera->assignment.SetTracked();
  } else if (frame->state == TrackingState::kLost) {
    camera->assignment.SetLost(now);
  }
  // With several cameras, one that is tracked shows that the initialization holds.
  if (has_pose || !state_.association.AnyTracked()) CheckProvisionalMap(index, *frame);
  if (!has_pose) CheckLoss(index, *frame);
  CheckDepth(index, *frame);
}

// A map without finite points gets them from the camera that started it. One that was entered later, or whose
// camera is gone, gets them from a camera that is tracked in it.
void MapPolicy::CheckDepth(std::size_t index, const TrackedFrame& frame) {
  MapAssignment& assignment = state_.cameras[index].assignment;
  if (frame.state != TrackingState::kPanorama || assignment.has_order() || assignment.is_starting()) return;
  const KnownMap* const map = state_.FindMap(frame.map_key);
  if (map == nullptr || !map->snapshot || map->snapshot->HasFinitePoints()) return;
  if (frame.map_key != state_.active_key || !MayAddKeyFrame(*map, frame.camera_from_map)) return;
  const auto is_starter = [map](const SystemCamera& camera) {
    return camera.assignment.map() == map->key && camera.assignment.is_starting();
  };
  for (const SystemCamera& other : state_.cameras) {
    if (is_starter(other) && other.is_connected) return;
  }
  if (mapping_.IsStarting(map->key)) return;
  // Two cameras that search at the same time would both begin the map.
  for (SystemCamera& other : state_.cameras) {
    if (is_starter(other)) other.assignment.Enter(map->key);
  }
  assignment.GiveDepth();
}

// Handles a pose in a map that the cameras are no longer in: while the frame was tracked, another camera
// relocalized elsewhere, or the application chose another map.
void MapPolicy::RejectPose(std::size_t index, TrackedFrame* frame) {
  state_.Emit(frame->frame.time, frame->map_key, PoseRejected{}, index);
  frame->state = TrackingState::kLost;
  frame->quality_class = TrackingQuality::kLost;
  frame->map.reset();
  frame->map_key = 0;
  frame->matches.clear();
  frame->finite_points = frame->infinite_points = 0;
  frame->hint = Hint::kFollowOtherCamera;
  state_.cameras[index].assignment.SearchAgain();
}

void MapPolicy::Disconnect(std::size_t index) {
  SystemCamera& gone = state_.cameras.at(index);
  gone.is_connected = gone.has_odometry = false;
  state_.association.SetLost(index);
  const KnownMap* const map = state_.FindMap(gone.assignment.map());
  if (!gone.assignment.started_map() || map == nullptr || !map->Exists() || map->snapshot) return;
  // Until the map has a pose, it may be the only one that a camera searches: one with images must start it.
  for (SystemCamera& other : state_.cameras) {
    if (!other.is_connected || other.assignment.map() != map->key) continue;
    other.assignment.Start(map->key, map->after_loss);
    return gone.assignment.WaitFor(map->key);
  }
}

void MapPolicy::EnterTrackedMap(std::size_t index, std::uint64_t key, Timestamp time) {
  const std::uint64_t previous = state_.cameras[index].assignment.map();
  state_.cameras[index].assignment.Follow(key);
  state_.Emit(time, key, MapEntered{}, index);
  // The other cameras abandon their search and enter this map (ptamm §3.3).
  for (SystemCamera& other : state_.cameras) {
    if (other.assignment.map() != key) other.assignment.Enter(key);
  }
  if (!options_.extend_maps || state_.active_key == key) return;
  LeavePreviousMap(previous, key, time);
  const KnownMap& map = state_.maps.at(key);
  Activate(map);
  joins_.Request(map);
}

// The previous map becomes idle, and is extended again when a camera returns to it.
void MapPolicy::LeavePreviousMap(std::uint64_t previous, std::uint64_t entered, Timestamp time) {
  const auto found = state_.maps.find(previous);
  if (found == state_.maps.end() || !found->second.Exists()) return;
  KnownMap& left = found->second;
  left.provisional.End();
  state_.Emit(time, previous, MapLeft{});
  if (!left.after_loss) return;
  // A map between two losses was left for the next new one, so that no return told what to join it with.
  for (auto& [key, map] : state_.maps) {
    if (key != entered && map.after_loss && map.join_with == 0 && map.MayBeJoined()) map.join_with = entered;
  }
  if (left.snapshot && left.snapshot->HasFinitePoints()) {
    left.join_with = entered;
    return;
  }
  if (!left.permissions.discard) return;
  left.Discard();
  index_.RemoveMap(previous);
  MapDiscarded event;
  event.reason = MapDiscarded::Reason::kRelocalizedElsewhere;
  event.other = entered;
  state_.Emit(time, previous, event);
}

void MapPolicy::CheckProvisionalMap(std::size_t index, const TrackedFrame& frame) {
  const MapAssignment& assignment = state_.cameras[index].assignment;
  const auto found = state_.maps.find(assignment.map());
  if (found == state_.maps.end()) return;
  KnownMap& map = found->second;
  const auto reason =
      map.provisional.Check(options_.provisional, {.frame = frame,
                                                   .in_map = frame.map_key == map.key,
                                                   .map = map.snapshot.get(),
                                                   .lost_since = assignment.lost_since(),
                                                   .may_extend = options_.extend_maps,
                                                   .may_discard = map.started_here && map.permissions.discard,
                                                   .starting = mapping_.IsStarting(map.key)});
  if (reason) Discard(index, frame.frame.time, *reason);
}

// Starts a new map for a camera that is lost and recognizes no map.
void MapPolicy::CheckLoss(std::size_t index, const TrackedFrame& frame) {
  const MapAssignment& assignment = state_.cameras[index].assignment;
  if (!options_.extend_maps || !options_.new_map_when_lost || state_.association.AnyTracked()) return;
  const auto found = state_.maps.find(assignment.map());
  // A map that the user stopped, or that may not be extended, is not left automatically.
  if (found == state_.maps.end() || found->second.provisional.is_pending() ||
      state_.active_key != found->first)
    return;
  const Timestamp now = frame.frame.time;
  // A place that the camera leaves into what is not mapped will not be recognized by waiting.
  if (!frame.left_map && !assignment.IsLostFor(options_.lost_time_before_new_map, now)) return;
  if (frame.relocalization.rejection == RejectionReason::kUnconfirmed) return;  // relocalization is imminent
  const std::uint64_t lost_in = found->first;
  const std::uint64_t key = NewKey();
  if (key == 0) return;
  state_.Emit(now, key, MapStartedAfterLoss{lost_in}, index);
  StartMap(key, index, true);
}

void MapPolicy::Discard(std::size_t index, Timestamp time, MapDiscarded event) {
  const std::uint64_t key = state_.cameras[index].assignment.map();
  KnownMap& map = state_.maps.at(key);
  const std::uint64_t next_key = NewKey();
  if (next_key == 0) return;
  map.Discard();
  index_.RemoveMap(key);
  KnownMap& next = state_.AddMap(next_key);
  next.started_here = true;
  next.after_loss = map.after_loss;
  event.replacement = next.key;
  state_.Emit(time, key, event);
  AssignMapper(next.key, nullptr);
  BeginTracking(next.key, next.after_loss);
  // Until the next map has a pose, it may be the only one that a camera searches: a camera with images must
  // start it.
  const auto is_starter = [key](const SystemCamera& camera) {
    return camera.is_connected && camera.assignment.map() == key && camera.assignment.started_map();
  };
  const bool has_starter = std::any_of(state_.cameras.begin(), state_.cameras.end(), is_starter);
  for (std::size_t i = 0; i < state_.cameras.size(); ++i) {
    MapAssignment& assignment = state_.cameras[i].assignment;
    if (assignment.map() != key) continue;
    if (has_starter ? is_starter(state_.cameras[i]) : i == index) {
      assignment.Start(next.key, next.after_loss);
    } else {
      assignment.WaitFor(next.key);
    }
  }
}

bool MapPolicy::MayAddKeyFrame(const KnownMap& map, const Rigid3& camera_from_map) const {
  if (!options_.extend_maps || !map.Exists() || !map.permissions.extend) return false;
  return !map.permissions.bounds || map.permissions.bounds->contains(camera_from_map.OriginInSource());
}

void MapPolicy::HandleMapperEvent(const MapperEvent& event, KnownMap* map) {
  if (std::holds_alternative<MapperEvent::MapStarted>(event.what)) {
    // The time of the check begins with the map: the mapper may have needed long for it.
    map->provisional.Begin(std::max(event.time, state_.LastTime()));
    for (std::size_t i = 0; i < state_.cameras.size(); ++i) {
      const SystemCamera& camera = state_.cameras[i];
      if (camera.assignment.map() != map->key || !camera.assignment.is_starting()) continue;
      state_.association.SetTracked(i, map->key);
      // Without images it would count as tracked for ever. The map has begun nevertheless.
      if (!camera.is_connected) state_.association.SetLost(i);
    }
  } else if (std::holds_alternative<MapperEvent::StartFailed>(event.what)) {
    for (SystemCamera& camera : state_.cameras) {
      // Another camera may have been told to start the map instead of one that was disconnected.
      const bool replaced = !camera.is_connected && camera.assignment.has_order();
      if (camera.assignment.map() == map->key && !replaced)
        camera.assignment.FailStart(map->snapshot != nullptr, map->after_loss);
    }
  }
  state_.Emit(event.time, map->key, event);
}

std::uint64_t MapPolicy::NewKey() const {
  if (options_.new_map_key) return options_.new_map_key();
  return state_.maps.empty() ? 1 : state_.maps.rbegin()->first + 1;
}

void MapPolicy::StartMap(std::uint64_t key, std::size_t camera, bool after_loss) {
  const std::uint64_t previous = state_.active_key;
  if (previous != 0) LeaveMap(previous);
  KnownMap& map = state_.AddMap(key);
  map.started_here = true;
  if (after_loss) map.after_loss = true;
  Activate(map);
  for (std::size_t i = 0; i < state_.cameras.size(); ++i) {
    if (i == camera) {
      state_.cameras[i].assignment.Start(key, after_loss);
    } else {
      state_.cameras[i].assignment.WaitFor(key);
    }
  }
  BeginTracking(key, after_loss);
}

// A single camera searches the initial views itself, and the known maps from the first pose on.
void MapPolicy::BeginTracking(std::uint64_t key, bool after_loss) {
  if (after_loss && state_.cameras.size() > 1) {
    state_.association.Release();
  } else {
    state_.association.Begin(key);
  }
}

void MapPolicy::EnterMap(std::uint64_t key, std::size_t camera) {
  const KnownMap& map = state_.maps.at(key);
  const std::uint64_t previous = state_.cameras.at(camera).assignment.map();
  if (previous == key) return Activate(map);
  if (previous != 0) LeaveMap(previous);
  state_.association.Release();
  for (SystemCamera& each : state_.cameras) each.assignment.Enter(key);
  Activate(map);
}

void MapPolicy::LeaveMap(std::uint64_t key) {
  if (state_.active_key == key) AssignMapper(0, nullptr);
  const auto found = state_.maps.find(key);
  if (found == state_.maps.end() || !found->second.Exists()) return;
  Timestamp time{};
  for (SystemCamera& camera : state_.cameras) {
    time = std::max(time, camera.last_time);
    if (camera.assignment.map() == key) camera.assignment.Leave();
  }
  if (state_.association.map() == key) state_.association.Release();
  found->second.provisional.End();
  const bool forgotten = found->second.WasNeverInitialized();
  if (forgotten) state_.maps.erase(found);
  state_.Emit(time, key, MapLeft{forgotten});
}

void MapPolicy::Activate(const KnownMap& map) {
  const bool extend = options_.extend_maps && map.permissions.extend;
  AssignMapper(extend ? map.key : 0, extend ? map.snapshot : nullptr);
}

void MapPolicy::AssignMapper(std::uint64_t key, std::shared_ptr<const MapSnapshot> snapshot) {
  SearchInitialViewsAgain();
  state_.active_key = key;
  joins_.Cancel();
  state_.adoption = mapping_.Adopt(key, std::move(snapshot));
}

// The mapper drops what it was given for the active map, and says nothing of the initial views among it, so
// that the camera that found them would wait for the map for ever. A map with finite points was made of them.
void MapPolicy::SearchInitialViewsAgain() {
  const KnownMap* const map = state_.FindMap(state_.active_key);
  if (map == nullptr || (map->snapshot && map->snapshot->HasFinitePoints())) return;
  for (SystemCamera& camera : state_.cameras) {
    if (camera.assignment.map() == map->key && !camera.assignment.has_order())
      camera.assignment.FailStart(map->snapshot != nullptr, map->after_loss);
  }
}

bool MapPolicy::IsUsed(std::uint64_t key) const {
  return key == state_.active_key || joins_.IsJoining(key) ||
         std::any_of(state_.cameras.begin(), state_.cameras.end(),
                     [key](const SystemCamera& camera) { return camera.assignment.map() == key; });
}

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "engine/mapping/calibration/lens_estimation.h"
#include "engine/system/calibration_monitor.h"
#include "engine/system/camera_association.h"
#include "engine/system/camera_rig.h"
#include "engine/system/map_assignment.h"
#include "engine/system/map_permissions.h"
#include "engine/system/provisional_map.h"
#include "engine/system/system_event.h"
#include "engine/tracking/tracker.h"

namespace docent::engine {

struct SystemCamera {
  std::unique_ptr<Tracker> tracker;  // used on the camera's thread, without the system's lock
  std::shared_ptr<const CameraModel> model;
  std::optional<std::size_t> lens_index;  // index in SystemState::lenses; empty for a known calibration
  std::unique_ptr<CalibrationMonitor> calibration_monitor;
  MapAssignment assignment;
  Timestamp last_time{};
  bool is_connected = true;   // delivers images
  bool has_odometry = false;  // it is followed in the copy of the map
};

// A map that the system knows.
struct KnownMap {
  std::uint64_t key = 0;
  std::shared_ptr<const MapSnapshot> snapshot;  // null while initialization is pending, or not in memory
  MapPermissions permissions;
  ProvisionalMap provisional;  // pending for a map that was started here until its depth is confirmed
  bool started_here = false;   // by a camera, and not added by the application
  bool had_snapshot = false;
  bool discarded = false;
  bool after_loss = false;        // started because the camera was lost in another map
  std::uint64_t join_with = 0;    // the map that this one is to be joined into if they overlap; 0 for none
  bool join_asked = false;        // a person asked for it, and has no answer yet
  std::size_t join_at = 0;        // number of keyframes of both maps from which joining is attempted
  std::uint64_t joined_into = 0;  // the map that it was joined into; 0 for none

  // Null when it is not in memory any more.
  void SetSnapshot(std::shared_ptr<const MapSnapshot> newer) {
    had_snapshot |= newer != nullptr;
    snapshot = std::move(newer);
  }
  // The map ends. Nothing reads the snapshot of a map that does not exist.
  void Discard() {
    discarded = true;
    snapshot.reset();
  }
  void JoinInto(std::uint64_t other) {
    joined_into = other;
    snapshot.reset();
  }
  // It was started here, and the mapper has not made anything of it.
  bool WasNeverInitialized() const { return started_here && !had_snapshot; }
  // False once the map was discarded or joined into another one.
  bool Exists() const { return !discarded && joined_into == 0; }
  bool MayBeJoined() const { return Exists() && permissions.join && snapshot && snapshot->HasFinitePoints(); }
};

// The copy of a map that is extended for visual odometry, while maps are only viewed.
struct OdometryCopy {
  std::uint64_t number = 0;                     // the mapper's name for it; 0 for none
  std::shared_ptr<const MapSnapshot> of;        // the map as it is known
  std::shared_ptr<const MapSnapshot> extended;  // null before the first keyframe
  bool invalid = false;  // a camera was relocalized: it is dropped once no camera depends on it
};

// What a System knows of its cameras and maps. The system's mutex guards all of it except the trackers.
struct SystemState {
  explicit SystemState(std::size_t number_of_cameras) : association(number_of_cameras) {}

  KnownMap& AddMap(std::uint64_t key) {
    KnownMap& map = maps[key];
    map.key = key;
    return map;
  }
  // Null if no map has this key.
  KnownMap* FindMap(std::uint64_t key) {
    const auto found = maps.find(key);
    return found == maps.end() ? nullptr : &found->second;
  }
  Timestamp LastTime() const;  // the latest of any camera
  template <typename What>
  void Emit(Timestamp time, std::uint64_t map, What what, std::size_t camera = 0) {
    events.push_back({time, map, camera, std::move(what)});
  }

  std::vector<SystemCamera> cameras;
  std::map<std::uint64_t, KnownMap> maps;
  CameraAssociation association;
  CameraRig rig;
  std::uint64_t active_key = 0;  // the map that the mapper works on; 0 for none
  std::uint64_t adoption = 0;    // the mapper's number for having adopted it last
  OdometryCopy copy;
  std::vector<EstimatedLens> lenses;  // of cameras with an unknown calibration
  std::vector<SystemEvent> events;
};

}  // namespace docent::engine

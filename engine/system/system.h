// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "engine/recognition/place_index.h"
#include "engine/system/calibration_monitor.h"
#include "engine/system/camera_association.h"
#include "engine/system/camera_place_finder.h"
#include "engine/system/camera_rig.h"
#include "engine/system/map_assignment.h"
#include "engine/system/mapping_thread.h"
#include "engine/system/provisional_map.h"
#include "engine/system/system_event.h"
#include "engine/tracking/tracker.h"

namespace docent::engine {

// What a System is made with. Fields of `tracker` and `mapper` are tuned together and may change with any
// version, except tracker.hybrid, tracker.target and mapper.lens.
struct SystemOptions {
  TrackerOptions tracker;   // build_maps is set by the system from extend_maps
  MapperOptions mapper;     // initialization, keyframes, adjustment, loops, unknown lenses
  bool threaded = true;     // mapper on its own thread; false: lockstep, runs are byte-identical
  bool extend_maps = true;  // false: known maps are tracked and never changed
  std::uint64_t seed = 1;   // of the random choices of robust estimation; equal seeds give equal runs
  ProvisionalMapOptions provisional;  // when a new map is confirmed, or discarded and started again
  // Whether a camera that is lost for `lost_time_before_new_map`, and recognises no map, starts a new map.
  bool new_map_when_lost = false;
  Timestamp lost_time_before_new_map = std::chrono::milliseconds(200);  // image time
  // Gives the key of a map that the system starts by itself, after a discarded one or a loss; 0 when there is
  // none now, then it tries again with the next frame. Must not block. Empty: keys count up from the largest
  // that was used.
  std::function<std::uint64_t()> new_map_key;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// What the application allows for a map.
struct MapPermissions {
  bool extend = true;                         // keyframes may be added, and the map adjusted
  std::optional<Eigen::AlignedBox3d> bounds;  // new keyframes only with their centre inside; map frame
  bool join = true;                           // may be joined with another map
  bool discard = true;                        // may be discarded while it is provisional
};

// The SLAM system: cameras that are tracked in several maps, of which one, the active map, is extended. It
// owns the trackers, the mapper and its thread, the place index, the association of the cameras and the
// decision which map is tracked; it knows neither files nor names nor content.
//
// Maps are named by keys greater than 0, which the application chooses. Maps that exist already are made
// known by AddMap, new ones are started by StartMap. A camera that relocalizes in another map takes the
// system there: that map becomes the active one. Several cameras belong to one wearer and work in one map
// together (CameraAssociation). A false initialization is discarded and repeated under a new key. With
// SystemOptions::new_map_when_lost, a lost camera starts another map; once it is back in the first one, the
// two are joined where they overlap.
//
// Threads: Process is called on the thread of the frame's camera (frame.camera); everything else may be
// called from any thread. Process waits neither for the mapper nor for a disk. Times are those of the images;
// no system clock influences the results. What happened is queued as SystemEvents, in order, for TakeEvents.
class System {
 public:
  // One model for each camera, in the order of Frame::camera; none is null. A camera whose calibration is
  // unknown has its initial model in options.mapper.lens too. Starts the mapper's thread unless the options
  // forbid it; no map is known yet, and the cameras are lost until StartMap, or AddMap with the place index,
  // gives them one. Throws Error if the options are invalid.
  System(const SystemOptions& options, std::vector<std::shared_ptr<const CameraModel>> cameras);
  ~System();
  System(const System&) = delete;
  System& operator=(const System&) = delete;

  // Tracks one image, and offers it to the mapper.
  TrackedFrame Process(const Frame& frame);
  // Details of the frame that Process returned last as `frame`; on the thread of its camera.
  FrameInspection Inspect(const TrackedFrame& frame) const;
  // Delays a source that delivers faster than a camera; see MappingThread::WaitUntilIdle.
  void WaitUntilIdle(std::chrono::steady_clock::time_point latest, const std::stop_token& stop) {
    mapping_.WaitUntilIdle(latest, stop);
  }
  // Stops the mapper after its urgent work. Throws what its thread threw. Process must not be called
  // afterwards.
  void Finish() { mapping_.Finish(); }

  // Makes a map known; the snapshot is null while it is not in memory. The place index is not changed:
  // whoever loads maps fills it.
  void AddMap(std::uint64_t key, std::shared_ptr<const MapSnapshot> snapshot,
              const MapPermissions& permissions);
  // A known map was loaded into memory, or evicted (null). Not for the active map.
  void SetSnapshot(std::uint64_t key, std::shared_ptr<const MapSnapshot> snapshot);
  // Replaces the snapshot of a map that is not in use, if it is still `expected`; false otherwise.
  bool ReplaceSnapshot(std::uint64_t key, const std::shared_ptr<const MapSnapshot>& expected,
                       std::shared_ptr<const MapSnapshot> snapshot);
  // Changes what is allowed for a known map, from the next image on.
  void SetPermissions(std::uint64_t key, const MapPermissions& permissions);

  // The camera starts a new map; the others follow. The active map is left.
  void StartMap(std::uint64_t key, std::size_t camera);
  // All cameras leave their map and search this one, which must be in memory.
  void EnterMap(std::uint64_t key, std::size_t camera);
  // No camera stays in the map, and it is no longer extended. A map that was never initialized is forgotten.
  void LeaveMap(std::uint64_t key);
  // Leaves the map, as LeaveMap does, and forgets it: no camera finds it any more.
  void RemoveMap(std::uint64_t key);
  // The mapper works on this map from now on, if its permissions allow it, and on none otherwise.
  void Activate(std::uint64_t key);

  // The map that the camera is in or searches; 0 for none.
  std::uint64_t CurrentMap(std::size_t camera) const;
  std::uint64_t ActiveMap() const;               // the map that is extended; 0 for none
  std::vector<std::uint64_t> MapsInUse() const;  // of all cameras
  // Whether a camera is in the map, or the mapper works on it or joins it.
  bool IsInUse(std::uint64_t key) const;
  // Whether the map was started here and its depth has not been confirmed yet; it may still be discarded.
  bool IsProvisional(std::uint64_t key) const;
  // Whether the mapper has nothing urgent to do.
  bool IsMapperIdle() const { return mapping_.IsIdle(); }
  // What the mapper has spent its time on so far.
  MapperTimes MappingTimes() const { return mapping_.Times(); }
  // The relative pose of the first two cameras in the current map; empty while it is unknown.
  std::optional<RigEstimate> Rig() const;
  // Mean radial reprojection errors of a camera by rings of the image, in pixels; see CalibrationMonitor.
  CalibrationMonitor::Profile RadialErrors(std::size_t camera) const;
  // The current estimate of a camera with an unknown calibration (SystemOptions::mapper.lens); empty for a
  // known calibration.
  std::optional<EstimatedLens> EstimatedLensOf(std::size_t camera) const;
  // The current estimates of all cameras with an unknown calibration.
  std::vector<EstimatedLens> EstimatedLenses() const;

  // Where lost cameras search. The system adds the maps that it extends; whoever adds others adds their
  // appearance.
  PlaceIndex& place_index() { return index_; }
  // Stands in front of the place index, for instance to load maps that are searched. Must outlive the system;
  // null for the index itself. To be called before the first frame.
  void SetPlaceFinder(const PlaceFinder* finder) { finder_ = finder; }

  // What happened since the last call, in order. To be called regularly: the events keep snapshots in memory.
  std::vector<SystemEvent> TakeEvents();
  // Called on the mapper's thread, without a lock, whenever it has queued events; before the first frame.
  void SetEventHook(std::function<void()> hook) { event_hook_ = std::move(hook); }

 private:
  // State of a camera. Guarded by mutex_ except for tracker, which belongs to the
  // camera's thread.
  struct Camera {
    std::unique_ptr<Tracker> tracker;
    std::shared_ptr<const CameraModel> model;
    std::optional<std::size_t> lens_index;  // index in lenses_; empty for a known calibration
    std::unique_ptr<CalibrationMonitor> calibration_monitor;
    MapAssignment assignment;
    Timestamp last_time{};
  };
  struct MapState {
    std::uint64_t key = 0;
    std::shared_ptr<const MapSnapshot> snapshot;  // null while initialization is pending, or not in memory
    MapPermissions permissions;
    ProvisionalMap provisional;  // pending for a map that was started here until its depth is confirmed
    bool discarded = false;
    bool after_loss = false;        // started because the camera was lost in another map
    std::uint64_t join_with = 0;    // the map that the camera returned to from this one; 0 for none
    std::size_t join_at = 0;        // number of keyframes of both maps from which joining is attempted
    std::uint64_t joined_into = 0;  // the map that it was joined into; 0 for none

    // False once the map was discarded or joined into another one.
    bool Exists() const { return !discarded && joined_into == 0; }
    bool MayBeJoined() const {
      return Exists() && permissions.join && snapshot && snapshot->HasFinitePoints();
    }
  };
  // A map that the mapper was asked to join into the active map.
  struct Joining {
    std::uint64_t number = 0, from = 0;
    std::shared_ptr<const MapSnapshot> snapshot;
  };

  // Applies the pending order to the camera's tracker, and returns the places that it may search.
  CameraPlaceFinder ApplyOrder(std::size_t index, Timestamp time);
  void OfferToMapper(std::size_t index, const TrackedFrame& frame);
  void OnMapperUpdate(const MappingThread::MapperUpdate& update);

  // With mutex_ held.
  void HandleResult(std::size_t index, TrackedFrame* frame);
  void RejectPose(std::size_t index, TrackedFrame* frame);
  void UpdateRig(std::size_t index, const TrackedFrame& frame);
  void CheckCalibration(std::size_t index, const TrackedFrame& frame);
  void CheckProvisionalMap(const Camera& camera, const TrackedFrame& frame);
  void CheckLoss(std::size_t index, const TrackedFrame& frame);
  void EnterTrackedMap(std::size_t index, std::uint64_t key, Timestamp time);
  void LeavePreviousMap(std::uint64_t previous, std::uint64_t entered, Timestamp time);
  void Discard(std::uint64_t key, Timestamp time, MapDiscarded event);
  void StartMapAt(std::uint64_t key, std::size_t camera, bool after_loss);
  void LeaveMapNow(std::uint64_t key);
  void ActivateNow(const MapState& map);
  void AssignMapper(std::uint64_t key, std::shared_ptr<const MapSnapshot> snapshot);
  void SetLenses(const std::vector<EstimatedLens>& lenses, Timestamp time);
  void HandleMapperEvent(const MapperEvent& event, MapState* map);
  void RequestJoin(const MapState& into);
  bool IsAwaited(const MappingThread::MapperUpdate::Join& update, const MapState& into);
  void HandleJoinAttempt(const MapJoinAttempt& attempt, MapState* into);
  bool MayAddKeyFrame(const MapState& map, const Rigid3& camera_from_map) const;
  MapState& AddState(std::uint64_t key);
  bool IsUsed(std::uint64_t key) const;
  std::uint64_t NewKey();
  Timestamp LastTime() const;  // the latest of any camera
  template <typename What>
  void Emit(Timestamp time, std::uint64_t map, What what, std::size_t camera = 0) {
    events_.push_back({time, map, camera, std::move(what)});
  }

  const SystemOptions options_;
  PlaceIndex index_;
  const PlaceFinder* finder_ = nullptr;
  std::function<void()> event_hook_;

  mutable std::mutex mutex_;  // guards the members below except the mapping thread; never held while tracking
  std::vector<Camera> cameras_;
  std::map<std::uint64_t, MapState> maps_;
  CameraAssociation association_;
  CameraRig rig_;
  bool rig_reported_ = false;     // whether the rig was last reported as rigid
  std::uint64_t active_key_ = 0;  // the map that the mapper works on; 0 for none
  std::optional<Joining> joining_;
  std::uint64_t joins_requested_ = 0;
  std::vector<EstimatedLens> lenses_;  // of cameras with an unknown calibration
  std::vector<SystemEvent> events_;
  MappingThread mapping_;  // last, because its thread calls back into the other members
};

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

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
#include "engine/system/camera_calibrations.h"
#include "engine/system/camera_place_finder.h"
#include "engine/system/map_policy.h"
#include "engine/system/mapping_thread.h"
#include "engine/system/system_event.h"
#include "engine/system/system_options.h"
#include "engine/system/system_state.h"

namespace docent::engine {

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
  // The camera delivers no images until the next Process with one of them. It counts as lost meanwhile, so
  // that the other cameras may search every map and start new ones. On the thread of its camera.
  void Disconnect(std::size_t camera);
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
  // Compares a map that is in memory and not in use with the active map, and joins them if both show the same
  // place. The answer is an event, MapsJoined or JoinRefused; a refused pair is compared again when the
  // active map has grown.
  void JoinIntoActiveMap(std::uint64_t from);
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
  // Whether the mapper has nothing urgent to do, and compares no maps.
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
  // Applies the pending order to the camera's tracker, and returns the places that it may search.
  CameraPlaceFinder ApplyOrder(std::size_t index, Timestamp time);
  void OfferToMapper(std::size_t index, const TrackedFrame& frame);
  // While maps are only viewed: offers the keyframes of visual odometry.
  void ExtendCopy(std::size_t index);
  void OnCopyExtended(const MappingThread::MapperUpdate& update);
  void OnMapperUpdate(const MappingThread::MapperUpdate& update);
  // Whether the mapper's answer belongs to the last request to join maps; with mutex_ held.
  bool IsAwaited(const MappingThread::MapperUpdate::Join& update, const KnownMap& into);

  const SystemOptions options_;
  PlaceIndex index_;
  const PlaceFinder* finder_ = nullptr;
  std::function<void()> event_hook_;

  // Guards the members below except the trackers and the mapping thread; never held while tracking.
  mutable std::mutex mutex_;
  SystemState state_;
  std::uint64_t copies_ = 0;  // of all maps, for visual odometry
  CameraCalibrations calibrations_;
  MapPolicy policy_;
  MappingThread mapping_;  // last, because its thread calls back into the other members
};

}  // namespace docent::engine

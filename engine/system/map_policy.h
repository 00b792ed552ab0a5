// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "engine/system/camera_calibrations.h"
#include "engine/system/map_join_requests.h"
#include "engine/system/mapping_thread.h"
#include "engine/system/system_options.h"
#include "engine/system/system_state.h"

namespace docent::engine {

// Decides which map the cameras are in, and which one the mapper extends: a camera that relocalizes elsewhere
// takes the others along (ptamm §3.3), a false initialization is discarded and repeated, a lost camera starts
// a new map, and a map that was started after a loss is joined with the one that the camera returned to. It
// changes the state, and gives the mapper its work. With the system's lock held.
class MapPolicy {
 public:
  // All pointers must outlive the policy.
  MapPolicy(const SystemOptions& options, SystemState* state, CameraCalibrations* calibrations,
            PlaceIndex* index, MappingThread* mapping)
      : options_(options),
        state_(*state),
        calibrations_(*calibrations),
        index_(*index),
        mapping_(*mapping),
        joins_(options.provisional.keyframes, state, index, mapping) {}

  // The result of one image; a pose in a map that the cameras have left is taken back.
  void HandleResult(std::size_t index, TrackedFrame* frame);
  // The camera delivers no images for now; see System::Disconnect.
  void Disconnect(std::size_t index);
  void HandleMapperEvent(const MapperEvent& event, KnownMap* map);
  MapJoinRequests& joins() { return joins_; }

  // The camera starts a map; the others follow. after_loss: because it was lost in another one.
  void StartMap(std::uint64_t key, std::size_t camera, bool after_loss);
  void EnterMap(std::uint64_t key, std::size_t camera);
  void LeaveMap(std::uint64_t key);
  // The mapper extends this map if its permissions allow it, and none otherwise.
  void Activate(const KnownMap& map);

  // Whether a camera is in the map, or the mapper works on it or joins it.
  bool IsUsed(std::uint64_t key) const;
  bool MayAddKeyFrame(const KnownMap& map, const Rigid3& camera_from_map) const;

 private:
  void RejectPose(std::size_t index, TrackedFrame* frame);
  void CheckProvisionalMap(std::size_t index, const TrackedFrame& frame);
  void CheckLoss(std::size_t index, const TrackedFrame& frame);
  void CheckDepth(std::size_t index, const TrackedFrame& frame);
  void EnterTrackedMap(std::size_t index, std::uint64_t key, Timestamp time);
  void LeavePreviousMap(std::uint64_t previous, std::uint64_t entered, Timestamp time);
  // Discards the map of this camera, and starts another one instead.
  void Discard(std::size_t index, Timestamp time, MapDiscarded event);
  // No camera is tracked in the new map yet. Those that wait for it may search the known maps after a loss.
  void BeginTracking(std::uint64_t key, bool after_loss);
  void AssignMapper(std::uint64_t key, std::shared_ptr<const MapSnapshot> snapshot);
  void SearchInitialViewsAgain();
  std::uint64_t NewKey() const;  // 0 if there is none now

  const SystemOptions& options_;
  SystemState& state_;
  CameraCalibrations& calibrations_;
  PlaceIndex& index_;
  MappingThread& mapping_;
  MapJoinRequests joins_;
};

}  // namespace docent::engine

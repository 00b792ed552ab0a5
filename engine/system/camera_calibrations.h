// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "engine/system/system_state.h"

namespace docent::engine {

// What tracked images say about the calibration of the cameras and about their relative pose, and the lenses
// that the mapper estimates for cameras with an unknown calibration. With the system's lock held.
class CameraCalibrations {
 public:
  explicit CameraCalibrations(SystemState* state) : state_(*state) {}

  // To be called with each frame that has a pose in a map that exists.
  void AddFrame(std::size_t index, const TrackedFrame& frame);
  // Passes the mapper's estimates to the cameras; to be called together with the update of the snapshot that
  // uses these lenses.
  void SetLenses(const std::vector<EstimatedLens>& lenses, Timestamp time);

 private:
  void CheckCalibration(std::size_t index, const TrackedFrame& frame);
  void UpdateRig(std::size_t index, const TrackedFrame& frame);

  SystemState& state_;
  bool rig_reported_ = false;  // whether the rig was last reported as rigid
};

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#include "engine/system/camera_calibrations.h"

#include <memory>

namespace docent::engine {

void CameraCalibrations::AddFrame(std::size_t index, const TrackedFrame& frame) {
  CheckCalibration(index, frame);
  UpdateRig(index, frame);
}

void CameraCalibrations::UpdateRig(std::size_t index, const TrackedFrame& frame) {
  if (state_.cameras.size() < 2 || index > 1) return;
  state_.rig.Add(static_cast<int>(index), frame.frame.time, frame.map_key, frame.camera_from_map);
  const auto& estimate = state_.rig.estimate();
  const bool rigid = estimate && estimate->rigid;
  if (rigid == rig_reported_) return;
  rig_reported_ = rigid;
  if (estimate) state_.Emit(frame.frame.time, frame.map_key, RigChanged{*estimate}, index);
}

void CameraCalibrations::CheckCalibration(std::size_t index, const TrackedFrame& frame) {
  const SystemCamera& camera = state_.cameras[index];
  camera.calibration_monitor->Add(frame);
  const auto mismatch = camera.calibration_monitor->TakeMismatch();
  // A residual pattern is expected while the calibration is still being estimated.
  const bool estimating = camera.lens_index && !state_.lenses[*camera.lens_index].fixed;
  if (mismatch && !estimating)
    state_.Emit(frame.frame.time, frame.map_key, CalibrationMismatch{*mismatch}, index);
}

void CameraCalibrations::SetLenses(const std::vector<EstimatedLens>& lenses, Timestamp time) {
  for (std::size_t i = 0; i < state_.cameras.size(); ++i) {
    SystemCamera& camera = state_.cameras[i];
    if (!camera.lens_index) continue;
    const EstimatedLens& lens = lenses[*camera.lens_index];
    const EstimatedLens& before = state_.lenses[*camera.lens_index];
    if (lens.model == before.model && lens.focal_sigma == before.focal_sigma && lens.fixed == before.fixed)
      continue;
    state_.Emit(time, 0, LensEstimated{lens}, i);
    if (lens.model == camera.model) continue;
    camera.model = lens.model;
    camera.calibration_monitor = std::make_unique<CalibrationMonitor>(lens.model);
  }
  state_.lenses = lenses;
}

}  // namespace docent::engine

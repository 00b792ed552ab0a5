// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "engine/map/map.h"
#include "engine/mapping/bundle/map_adjustment.h"
#include "engine/mapping/calibration/readout_estimation.h"

namespace docent::engine {

struct ReadoutCalibration {
  bool changed = false;  // of the keyframes: then poses and points have to be adjusted
  // The estimate, if a readout time is in use now.
  std::optional<ReadoutPrior> estimate = std::nullopt;
};

// Estimates the readout time of the camera of `newest` from this keyframe and those around it, as in
// AdjustLocally, and gives it to all keyframes of the camera if it is significant and differs from that in
// use. A readout time that the calibration states is kept. Mapper's thread.
ReadoutCalibration CalibrateReadout(const ReadoutEstimationOptions& options,
                                    const MapAdjustmentOptions& window, KeyFrameId newest, Map* map);

}  // namespace docent::engine

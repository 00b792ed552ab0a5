// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "engine/geometry/camera_model.h"

namespace docent::app {

// Simulates an inaccurate calibration of a lens. Focal lengths are multiplied by 1 + focal_error. The first
// distortion coefficient is changed until the RMS displacement of rays over the image is
// |distortion_error_px| (measured with the true focal length); the sign of distortion_error_px is the sign of
// the change. Throws docent::Error when no coefficient achieves that, or
// when no calibration file could hold the result.
engine::CameraModel WrongCalibration(const engine::CameraModel& lens, double focal_error,
                                     double distortion_error_px);

// RMS distance, over a grid of pixels, between the projections of the same ray by `calibration` and by
// `lens`. Empty when the calibration cannot project one of the rays.
std::optional<double> MisplacementRms(const engine::CameraModel& calibration,
                                      const engine::CameraModel& lens);

}  // namespace docent::app

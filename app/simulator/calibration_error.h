// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "engine/geometry/camera_model.h"

namespace docent::app {

// The calibration that somebody who measured badly has of a lens. Focal lengths are multiplied by 1 +
// focal_error. The first distortion coefficient is changed until rays fall, by the root mean square over the
// image, distortion_error_px beside their place (measured with the true focal length); its sign is that of
// the change. Throws docent::Error where no coefficient does that.
engine::CameraModel WrongCalibration(const engine::CameraModel& lens, double focal_error,
                                     double distortion_error_px);

// Root mean square over a grid of pixels of the distance between where `calibration` and `lens` project the
// ray that the lens has there. Empty where the calibration has no place for one of them.
std::optional<double> MisplacementRms(const engine::CameraModel& calibration,
                                      const engine::CameraModel& lens);

}  // namespace docent::app

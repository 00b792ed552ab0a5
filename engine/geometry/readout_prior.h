// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <optional>

#include "engine/geometry/camera_model.h"

namespace docent::engine {

// What is known of the readout time of a rolling shutter before a map has it, seconds; see ReadoutMotion.
struct ReadoutPrior {
  Eigen::Vector2d readout_s = Eigen::Vector2d::Zero();
  double sigma_s = 0;  // standard deviation of each entry
};

// The entry of readout_s that may differ from zero: sensors are wider than high and are read row by row, so
// that lines are exposed one after another along the shorter side of the image, however the camera is held.
// Empty if the sides are nearly equal, as in an image that was cropped; no sensor is squarer than 5:4.
inline std::optional<Eigen::Index> ReadoutAxis(const CameraModel& camera) {
  constexpr double kMinAspect = 1.15;  // between 1 and 5:4
  const double width = camera.width_px(), height = camera.height_px();
  if (std::max(width, height) < kMinAspect * std::min(width, height)) return std::nullopt;
  return width > height ? 1 : 0;
}

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "engine/geometry/camera_model.h"

namespace docent::ui {

// An arrow at the edge of an image that points to something outside of it.
struct EdgeArrow {
  Eigen::Vector2d tip = Eigen::Vector2d::Zero();  // Pixel.
  Eigen::Vector2d direction =
      Eigen::Vector2d::UnitX();  // Unit vector in the image: where to turn the camera.
};

// The arrow to a point in the camera frame, whose tip is margin_px inside the image; empty if the point is
// seen at least that far inside. For a point behind the camera it shows the shorter way to turn.
std::optional<EdgeArrow> ArrowTowards(const engine::CameraModel& camera,
                                      const Eigen::Vector3d& point_in_camera, double margin_px);

}  // namespace docent::ui

// SPDX-License-Identifier: Apache-2.0
#include "ui/edge_arrow.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace docent::ui {

std::optional<EdgeArrow> ArrowTowards(const engine::CameraModel& camera,
                                      const Eigen::Vector3d& point_in_camera, double margin_px) {
  const auto pixel = camera.Project(point_in_camera);
  if (pixel && camera.IsInside(*pixel, margin_px)) return std::nullopt;
  EdgeArrow arrow;
  // The camera comes to look at the point by a rotation about the axis that is perpendicular to both the
  // optical axis and the point, so that the point's x and y give the direction, also behind the camera.
  const Eigen::Vector2d across = point_in_camera.head<2>();
  if (across.norm() > 1e-9 * point_in_camera.norm()) arrow.direction = across.normalized();
  const Eigen::Vector2d last(camera.width_px() - 1, camera.height_px() - 1);
  const Eigen::Vector2d middle = 0.5 * last;
  const Eigen::Vector2d reach = (middle - Eigen::Vector2d::Constant(margin_px)).cwiseMax(1.0);
  double length = std::numeric_limits<double>::infinity();
  for (const int axis : {0, 1}) {
    const double speed = std::abs(arrow.direction[axis]);
    if (speed > 0) length = std::min(length, reach[axis] / speed);
  }
  arrow.tip = middle + length * arrow.direction;
  return arrow;
}

}  // namespace docent::ui

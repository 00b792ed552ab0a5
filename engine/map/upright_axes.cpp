// SPDX-License-Identifier: Apache-2.0
#include "engine/map/upright_axes.h"

#include <Eigen/Geometry>

namespace docent::engine {

Eigen::Vector3d UpInMap(const MapSnapshot& map) {
  Eigen::Vector3d down = Eigen::Vector3d::Zero();
  for (const KeyFrame& keyframe : map.keyframes) {
    down += keyframe.camera_from_map.rotation.inverse() * Eigen::Vector3d::UnitY();
  }
  return down.norm() > 1e-6 ? Eigen::Vector3d(-down.normalized())
                            : Eigen::Vector3d(-Eigen::Vector3d::UnitY());
}

UprightAxes UprightAxesOf(const MapSnapshot& map) {
  if (map.keyframes.empty()) return {};
  return UprightAxesOf(map, UpInMap(map));
}

UprightAxes UprightAxesOf(const MapSnapshot& map, const Eigen::Vector3d& up) {
  UprightAxes axes;
  axes.up = up;
  Eigen::Vector3d ahead = Eigen::Vector3d::UnitZ();
  if (!map.keyframes.empty())
    ahead = map.keyframes.front().camera_from_map.rotation.inverse() * Eigen::Vector3d::UnitZ();
  ahead -= ahead.dot(axes.up) * axes.up;
  if (ahead.norm() < 1e-3) ahead = axes.up.unitOrthogonal();
  axes.ahead = ahead.normalized();
  axes.right = axes.ahead.cross(axes.up);
  return axes;
}

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#include "app/session/way_to_map.h"

namespace docent::app {

std::optional<Eigen::Vector3d> BeginOf(const engine::MapSnapshot& map) {
  for (const engine::KeyFrame& keyframe : map.keyframes) {
    if (keyframe.kind == engine::KeyFrameKind::kSixDof) return keyframe.camera_from_map.OriginInSource();
  }
  return std::nullopt;
}

std::optional<Eigen::Vector3d> DirectionToMap(const content::Signpost& signpost, const engine::Sim3& a_from_b,
                                              const engine::MapSnapshot& b) {
  const std::optional<Eigen::Vector3d> begin = BeginOf(b);
  if (!begin) return std::nullopt;
  const Eigen::Vector3d way = a_from_b * *begin - content::BoardMiddle(signpost);
  // Nearer than the size of the board, the direction would depend on where the board hangs.
  if (!(way.norm() > signpost.height)) return std::nullopt;
  return way.normalized();
}

}  // namespace docent::app

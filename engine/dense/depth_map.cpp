// SPDX-License-Identifier: Apache-2.0
#include "engine/dense/depth_map.h"

#include "engine/vision/image_pyramid.h"

namespace docent::engine {

LevelRays::LevelRays(const CameraModel& camera, int level, Storage storage)
    : camera_(camera),
      level_(level),
      width_px_(camera.width_px() >> level),
      height_px_(camera.height_px() >> level) {
  if (storage == Storage::kComputed) return;
  rays_.reserve(static_cast<std::size_t>(width_px_) * static_cast<std::size_t>(height_px_));
  for (int y = 0; y < height_px_; ++y) {
    for (int x = 0; x < width_px_; ++x) rays_.push_back(Compute(x, y));
  }
}

Eigen::Vector3f LevelRays::Compute(int x, int y) const {
  const auto ray = camera_.Unproject(LevelZeroFromLevel({x, y}, level_));
  return ray.value_or(Eigen::Vector3d::Zero()).cast<float>();
}

std::optional<Eigen::Vector2d> LevelRays::Project(const Eigen::Vector3d& point_in_camera) const {
  const auto pixel = camera_.Project(point_in_camera);
  if (!pixel) return std::nullopt;
  const Eigen::Vector2d in_level = LevelFromLevelZero(*pixel, level_);
  const bool inside = in_level.x() >= 0 && in_level.y() >= 0 && in_level.x() <= width_px_ - 1 &&
                      in_level.y() <= height_px_ - 1;
  return inside ? std::optional(in_level) : std::nullopt;
}

}  // namespace docent::engine

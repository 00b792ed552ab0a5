// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "engine/map/map.h"
#include "tests/engine/rendered_world.h"

// Panorama maps for tests: blank ones, and a room all around the camera.
namespace docent::engine::testing_world {

// A keyframe of 64x64 blank pixels, for tests that need no image.
inline KeyFrame BlankKeyFrame(const Rigid3& camera_from_map = {}) {
  static const auto camera = PinholeCamera(64, 64);
  static const auto features = [] {
    auto made = std::make_shared<ImageFeatures>();
    for (int level = 0; level < kPyramidLevels; ++level)
      made->levels[static_cast<std::size_t>(level)] =
          cv::Mat(64 >> level, 64 >> level, CV_8UC1, cv::Scalar(0));
    return std::shared_ptr<const ImageFeatures>(made);
  }();
  KeyFrame keyframe;
  keyframe.camera = camera;
  keyframe.features = features;
  keyframe.camera_from_map = camera_from_map;
  return keyframe;
}

// Bitwise equality.
inline bool SamePose(const Rigid3& a, const Rigid3& b) {
  return a.translation == b.translation &&
         a.rotation.quaternion().coeffs() == b.rotation.quaternion().coeffs();
}

// Four walls, each three metres away, and smaller ones in front of them.
inline RenderedWorld Chamber(std::uint64_t seed) {
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
                        z = Eigen::Vector3d::UnitZ();
  return RenderedWorld(
      {PaintedWall({0, 0, 3}, x, y, 3, 2.5, seed), PaintedWall({3, 0, 0}, -z, y, 3, 2.5, seed + 1),
       PaintedWall({0, 0, -3}, -x, y, 3, 2.5, seed + 2), PaintedWall({-3, 0, 0}, z, y, 3, 2.5, seed + 3),
       PaintedWall({-0.6, 0.5, 2.1}, x, y, 0.4, 0.4, seed + 4),
       PaintedWall({1.6, -0.3, 1.6}, (x - z).normalized(), y, 0.5, 0.4, seed + 5),
       PaintedWall({2.2, 0.4, -0.4}, -z, y, 0.4, 0.5, seed + 6)});
}

// Like MakeKeyFrame, but for a dependent keyframe, which is rotated only: its assumed position is that of the
// panorama map's reference.
inline KeyFrame MakeDependent(const RenderedWorld& world, const std::shared_ptr<const CameraModel>& camera,
                              const Rigid3& camera_from_world, PanoramaId panorama,
                              const Eigen::Vector3d& reference_center) {
  KeyFrame keyframe = MakeKeyFrame(world, camera, camera_from_world);
  keyframe.kind = KeyFrameKind::kPanorama;
  keyframe.panorama = panorama;
  const Rotation3& rotation = camera_from_world.rotation;
  keyframe.camera_from_map = Rigid3(rotation, -(rotation * reference_center));
  return keyframe;
}

}  // namespace docent::engine::testing_world

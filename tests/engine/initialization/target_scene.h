// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <opencv2/core.hpp>

#include "engine/initialization/planar_target.h"
#include "tests/engine/geometry/test_math.h"
#include "tests/engine/rendered_world.h"

// A painted board in front of a painted wall, and the image of the board that a user would supply, for tests
// of planar targets. World frame: x right, y down, z forward, metres.
namespace docent::engine::testing_world {

struct TargetScene {
  RenderedWorld world{{}};
  cv::Mat image;  // of the board, CV_8UC1
  double width_m = 0;
  Rigid3 world_from_target;

  // The centre of the board is 2 m ahead.
  explicit TargetScene(std::uint64_t seed, bool with_objects = false) {
    const Eigen::Vector3d x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(), middle(0, 0, 2);
    const Wall board = PaintedWall(middle, x, y, 0.8, 0.6, seed);
    std::vector<Wall> walls = {board, PaintedWall({0, 0, 3.2}, x, y, 5, 4, seed + 100)};
    if (with_objects) {
      walls.push_back(PaintedWall({-1.3, 0.1, 2.2}, x, y, 0.35, 0.6, seed + 200));
      walls.push_back(PaintedWall({1.3, -0.1, 1.8}, x, y, 0.35, 0.6, seed + 300));
    }
    world = RenderedWorld(walls);
    board.paint.convertTo(image, CV_8UC1);
    width_m = image.cols * kTexelSize;
    // The first texel of the texture lies on the edge of the board, the first pixel of an image half a pixel
    // inside.
    const Eigen::Vector3d off((image.cols - 1) * kTexelSize / 2 - 0.8,
                              (image.rows - 1) * kTexelSize / 2 - 0.6, 0);
    world_from_target = Rigid3(Rotation3(), middle + off);
  }
};

// The camera of 640x480 pixels that sees the board.
inline const std::shared_ptr<const CameraModel>& BoardCamera() {
  static const auto camera = PinholeCamera(640, 480);
  return camera;
}

// A camera that looks at the centre of the board from a distance, `slant_deg` to the right of its normal and
// `rise_deg` above it, rotated about its optical axis; camera_from_world.
inline Rigid3 LookAtBoard(double distance, double slant_deg, double rise_deg, double roll_deg) {
  const Rotation3 world_from_camera = Rotation3::Exp({0, -Radians(slant_deg), 0}) *
                                      Rotation3::Exp({-Radians(rise_deg), 0, 0}) *
                                      Rotation3::Exp({0, 0, Radians(roll_deg)});
  const Eigen::Vector3d center =
      Eigen::Vector3d(0, 0, 2) - distance * (world_from_camera * Eigen::Vector3d::UnitZ());
  return Rigid3(world_from_camera, center).inverse();
}

}  // namespace docent::engine::testing_world

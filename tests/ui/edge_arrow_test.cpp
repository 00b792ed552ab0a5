// SPDX-License-Identifier: Apache-2.0
#include "ui/edge_arrow.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "engine/base/random.h"
#include "engine/geometry/rigid3.h"

namespace docent::ui {
namespace {

using Eigen::Vector3d;

engine::CameraModel ArrowCamera() {
  engine::CameraModel::Intrinsics in;
  in.width_px = 640;
  in.height_px = 480;
  in.fx = in.fy = 500;
  in.cx = 319.5;
  in.cy = 239.5;
  return engine::CameraModel(engine::LensModel::kRadialTangential, in, {});
}

double AngleToAxis(const Vector3d& point) {
  return std::atan2(point.head<2>().norm(), point.z());
}

TEST(EdgeArrow, IsAbsentForWhatIsSeen) {
  EXPECT_FALSE(ArrowTowards(ArrowCamera(), {0, 0, 2}, 20));
  EXPECT_FALSE(ArrowTowards(ArrowCamera(), {0.5, 0.3, 2}, 20));
  EXPECT_TRUE(ArrowTowards(ArrowCamera(), {2.5, 0, 2}, 20));
  EXPECT_TRUE(ArrowTowards(ArrowCamera(), {0, 0, -2}, 20)) << "behind the camera";
}

TEST(EdgeArrow, LiesAtTheEdgeInTheDirectionOfThePoint) {
  const auto right = ArrowTowards(ArrowCamera(), {5, 0, 1}, 20);
  ASSERT_TRUE(right);
  EXPECT_NEAR(right->tip.x(), 619, 1e-9);
  EXPECT_NEAR(right->tip.y(), 239.5, 1e-9);
  const auto above = ArrowTowards(ArrowCamera(), {0, -5, -1}, 20);
  ASSERT_TRUE(above);
  EXPECT_NEAR(above->tip.x(), 319.5, 1e-9);
  EXPECT_NEAR(above->tip.y(), 20, 1e-9);
}

// Turning the camera by ten degrees in the arrow's direction brings the point ten degrees nearer.
TEST(EdgeArrow, ShowsTheShortestWayToTurn) {
  Random random(5);
  int arrows = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const Vector3d point(random.Uniform(-3, 3), random.Uniform(-3, 3), random.Uniform(-3, 3));
    const auto arrow = ArrowTowards(ArrowCamera(), point, 20);
    const double before = AngleToAxis(point);
    if (!arrow || before < 0.3 || before > std::numbers::pi - 0.01) continue;
    ++arrows;
    const double turn = std::numbers::pi / 18;
    // The rotation that takes the optical axis towards the arrow's direction.
    const Vector3d axis(-arrow->direction.y(), arrow->direction.x(), 0);
    const Vector3d turned = engine::Rotation3::Exp(-turn * axis) * point;
    ASSERT_NEAR(AngleToAxis(turned), before - turn, 1e-9);
    ASSERT_GE(arrow->tip.x(), 20 - 1e-9);
    ASSERT_LE(arrow->tip.x(), 619 + 1e-9);
    ASSERT_GE(arrow->tip.y(), 20 - 1e-9);
    ASSERT_LE(arrow->tip.y(), 459 + 1e-9);
  }
  EXPECT_GT(arrows, 1000);
}

}  // namespace
}  // namespace docent::ui

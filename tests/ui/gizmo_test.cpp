// SPDX-License-Identifier: Apache-2.0
#include "ui/gizmo.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "ui/entity_section.h"

namespace docent::ui {
namespace {

constexpr double kTestPi = std::numbers::pi;

// 640 x 480 without distortion, 500 pixels focal length, at the map's origin, looking along z.
GizmoCamera PinholeCamera() {
  return {engine::CameraModel(engine::LensModel::kRadialTangential, {640, 480, 500, 500, 319.5, 239.5}, {}),
          {}};
}

// At five map units straight ahead: right along x, up along -y, front towards the camera.
Gizmo StandingGizmo() {
  Gizmo gizmo;
  gizmo.origin = {0, 0, 5};
  Eigen::Matrix3d axes;
  axes.col(0) = Eigen::Vector3d::UnitX();
  axes.col(1) = -Eigen::Vector3d::UnitY();
  axes.col(2) = -Eigen::Vector3d::UnitZ();
  gizmo.map_from_axes = engine::Rotation3(axes);
  return gizmo;
}

Eigen::Vector2d PixelOf(const GizmoCamera& camera, const Eigen::Vector3d& place) {
  return *camera.lens.Project(camera.camera_from_map * place);
}

GizmoDrag Started(const Gizmo& gizmo, GizmoPart part, const GizmoCamera& camera, const Eigen::Vector3d& at) {
  auto drag = GizmoDrag::Begin(gizmo, part, camera, PixelOf(camera, at));
  EXPECT_TRUE(drag);
  return *drag;
}

TEST(Gizmo, HasArrowsOfTheWantedLengthInTheImage) {
  const GizmoCamera camera = PinholeCamera();
  Gizmo gizmo = StandingGizmo();
  gizmo.length = *GizmoLength(camera, gizmo.origin, 80);
  EXPECT_NEAR(gizmo.length, 80.0 / 500 * 5, 1e-12);
  const GizmoLines lines = LinesOf(gizmo, GizmoPart::kMoveRight, camera);
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_NEAR((lines[0].back() - lines[0].front()).norm(), 80, 1e-9);
  EXPECT_FALSE(GizmoLength(camera, {0, 0, -1}, 80)) << "behind the camera";
}

TEST(Gizmo, FindsTheHandleUnderThePointer) {
  const GizmoCamera camera = PinholeCamera();
  const Gizmo gizmo = StandingGizmo();
  const auto part = [&](const Eigen::Vector3d& place) {
    return PartAt(gizmo, camera, PixelOf(camera, place), 6);
  };
  EXPECT_EQ(part({0.9, 0, 5}), GizmoPart::kMoveRight);
  EXPECT_EQ(part({0, -0.9, 5}), GizmoPart::kMoveUp);
  EXPECT_EQ(part({0, -1.2, 5}), GizmoPart::kScale);
  const double diagonal = 0.8 * std::sqrt(0.5);
  EXPECT_EQ(part({diagonal, diagonal, 5}), GizmoPart::kTurnFront);
  EXPECT_EQ(part({0.42, -0.42, 5}), GizmoPart::kMoveAcrossFront);
  EXPECT_EQ(part({2, 2, 5}), GizmoPart::kNone);
}

TEST(Gizmo, ASignpostHasNoRings) {
  Gizmo gizmo = StandingGizmo();
  gizmo.turns = false;
  for (const GizmoPart part : PartsOf(gizmo)) {
    EXPECT_NE(part, GizmoPart::kTurnUp);
    EXPECT_NE(part, GizmoPart::kTurnRight);
    EXPECT_NE(part, GizmoPart::kTurnFront);
  }
}

TEST(Gizmo, AnArrowMovesAlongItsAxisOnly) {
  const GizmoCamera camera = PinholeCamera();
  GizmoDrag drag = Started(StandingGizmo(), GizmoPart::kMoveRight, camera, {0.5, 0, 5});
  // The pointer moves right by 0.3 map units at the gizmo's depth, and down by 0.2, which does not count.
  const engine::Sim3 motion = drag.Update(camera, PixelOf(camera, {0.8, 0.2, 5}), false);
  EXPECT_LT((motion.translation - Eigen::Vector3d(0.3, 0, 0)).norm(), 0.02);
  EXPECT_EQ(motion.translation.y(), 0);
  EXPECT_EQ(motion.translation.z(), 0);
  EXPECT_EQ(motion.scale, 1);
  EXPECT_EQ(motion.rotation.Angle(), 0);
}

TEST(Gizmo, APlaneKeepsThePointUnderThePointer) {
  // Seen obliquely from above: the camera is tilted down by 40 degrees.
  GizmoCamera camera = PinholeCamera();
  camera.camera_from_map.rotation = engine::Rotation3::Exp({40 * kTestPi / 180, 0, 0});
  Gizmo gizmo = StandingGizmo();
  gizmo.origin = camera.camera_from_map.inverse() * Eigen::Vector3d(0.2, 0.1, 5);
  for (const GizmoPart part : {GizmoPart::kMoveAcrossUp, GizmoPart::kGround}) {
    const Eigen::Vector3d held = gizmo.origin + Eigen::Vector3d(0.3, 0, 0.2);
    const Eigen::Vector3d to = gizmo.origin + Eigen::Vector3d(-0.7, 0, 0.9);
    GizmoDrag drag = Started(gizmo, part, camera, held);
    const engine::Sim3& motion = drag.Update(camera, PixelOf(camera, to), false);
    EXPECT_LT((motion * held - to).norm(), 1e-9);
    EXPECT_NEAR(motion.translation.y(), 0, 1e-12) << "the height stays";
  }
}

TEST(Gizmo, APlaneSeenFromItsEdgeCannotBeHeld) {
  const GizmoCamera camera = PinholeCamera();
  EXPECT_FALSE(GizmoDrag::Begin(StandingGizmo(), GizmoPart::kGround, camera, {319.5, 239.5}));
  EXPECT_FALSE(GizmoDrag::Begin(StandingGizmo(), GizmoPart::kMoveFront, camera, {319.5, 239.5}))
      << "an arrow that points at the camera";
}

TEST(Gizmo, ADragOverTheHorizonKeepsTheLastPlace) {
  GizmoCamera camera = PinholeCamera();
  camera.camera_from_map.rotation = engine::Rotation3::Exp({20 * kTestPi / 180, 0, 0});
  Gizmo gizmo = StandingGizmo();
  gizmo.origin = camera.camera_from_map.inverse() * Eigen::Vector3d(0, 0, 5);
  GizmoDrag drag = Started(gizmo, GizmoPart::kGround, camera, gizmo.origin);
  const engine::Sim3 before = drag.Update(camera, {400, 300}, false);
  EXPECT_GT(before.translation.norm(), 0.1);
  // The horizon is 20 degrees above the middle: 500 tan 20 = 182 pixels.
  const engine::Sim3 after = drag.Update(camera, {400, 239.5 - 190}, false);
  EXPECT_EQ(after.translation, before.translation);
}

TEST(Gizmo, ARingTurnsAboutItsAxisByTheAngleOfThePointer) {
  const GizmoCamera camera = PinholeCamera();
  const Gizmo gizmo = StandingGizmo();
  const auto on_ring = [&](double angle) -> Eigen::Vector3d {  // From right to up.
    return gizmo.origin + 0.8 * (std::cos(angle) * gizmo.Axis(0) + std::sin(angle) * gizmo.Axis(1));
  };
  for (const double angle : {0.3, 1.2, -0.8, 3.0}) {
    GizmoDrag drag = Started(gizmo, GizmoPart::kTurnFront, camera, on_ring(0.4));
    const engine::Sim3& motion = drag.Update(camera, PixelOf(camera, on_ring(0.4 + angle)), false);
    EXPECT_LT((motion * on_ring(0.4) - on_ring(0.4 + angle)).norm(), 1e-9);
    EXPECT_LT((motion * gizmo.origin - gizmo.origin).norm(), 1e-12);
    EXPECT_NEAR(motion.rotation.Angle(), std::abs(angle), 1e-9);
  }
}

TEST(Gizmo, ScalesByTheDistanceFromTheOriginInTheImage) {
  const GizmoCamera camera = PinholeCamera();
  const Gizmo gizmo = StandingGizmo();
  GizmoDrag drag = Started(gizmo, GizmoPart::kScale, camera, {0, -1.2, 5});
  const engine::Sim3& motion = drag.Update(camera, PixelOf(camera, {1.8, 0, 5}), false);
  EXPECT_NEAR(motion.scale, 1.5, 1e-9);
  EXPECT_LT((motion * gizmo.origin - gizmo.origin).norm(), 1e-12);
  EXPECT_LT((motion * Eigen::Vector3d(1, 0, 5) - Eigen::Vector3d(1.5, 0, 5)).norm(), 1e-9);
  drag.Update(camera, PixelOf(camera, {0.004, 0, 5}), false);
  EXPECT_GT(drag.motion().scale, 0) << "it cannot vanish";
}

TEST(Gizmo, RoundsToSteps) {
  const GizmoCamera camera = PinholeCamera();
  Gizmo gizmo = StandingGizmo();
  gizmo.length = 1.2;  // A fifth is 0.24, so that the step is 0.2.
  GizmoDrag move = Started(gizmo, GizmoPart::kMoveRight, camera, {0.5, 0, 5});
  EXPECT_NEAR(move.steps().length, 0.2, 1e-12);
  EXPECT_NEAR(move.Update(camera, PixelOf(camera, {1.18, 0, 5}), true).translation.x(), 0.6, 1e-9);
  const auto on_ring = [&](double degrees) -> Eigen::Vector3d {
    const double angle = degrees * kTestPi / 180;
    return gizmo.origin + std::cos(angle) * gizmo.Axis(0) + std::sin(angle) * gizmo.Axis(1);
  };
  GizmoDrag turn = Started(gizmo, GizmoPart::kTurnFront, camera, on_ring(10));
  EXPECT_NEAR(turn.Update(camera, PixelOf(camera, on_ring(10 + 40)), true).rotation.Angle(), kTestPi / 4,
              1e-9);
  GizmoDrag scale = Started(gizmo, GizmoPart::kScale, camera, {1, 0, 5});
  EXPECT_NEAR(scale.Update(camera, PixelOf(camera, {1.33, 0, 5}), true).scale, 1.3, 1e-9);
  gizmo.length = 0.05;  // A fifth is 0.01 exactly.
  EXPECT_NEAR(Started(gizmo, GizmoPart::kMoveRight, camera, {0.05, 0, 5}).steps().length, 0.01, 1e-12);
}

TEST(Angles, ArePreservedByTheirRotation) {
  for (const double up : {-170.0, -20.0, 0.0, 75.0, 180.0}) {
    for (const double right : {-80.0, 0.0, 35.0}) {
      for (const double front : {-100.0, 0.0, 60.0}) {
        const Eigen::Vector3d angles(up, right, front);
        EXPECT_LT((AnglesOf(RotationOf(angles)) - angles).norm(), 1e-9) << angles.transpose();
      }
    }
  }
  // About up alone, the front (z) turns to the right (x).
  EXPECT_LT((RotationOf({90, 0, 0}) * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 1e-12);
}

TEST(Angles, KeepARotationThatLooksStraightUpOrDown) {
  for (const double right : {-90.0, 90.0}) {
    const engine::Rotation3 rotation = RotationOf({30, right, 20});
    const engine::Rotation3 again = RotationOf(AnglesOf(rotation));
    EXPECT_LT((rotation.matrix() - again.matrix()).norm(), 1e-6);
  }
}

}  // namespace
}  // namespace docent::ui

// SPDX-License-Identifier: Apache-2.0
#include "app/session/eye_view.h"

#include <gtest/gtest.h>

namespace docent::app {
namespace {

constexpr double kMetresPerUnit = 0.5, kEyes_m = 0.064;

// A visitor with a display whose eyes are 64 mm apart, level with the camera between them, in a map of half
// metres.
struct Wearer {
  Wearer() {
    for (const std::size_t i : {0u, 1u}) {
      DisplayEye& eye = display.eyes[i];
      eye.camera = {engine::LensModel::kRadialTangential, {1280, 720, 1400, 1400, 639.5, 359.5}, {}};
      eye.eye_from_camera.translation.x() = (i == 0 ? 0.5 : -0.5) * kEyes_m;
    }
    auto scene = std::make_shared<content::Scene>();
    scene->settings.metres_per_unit = kMetresPerUnit;
    frame.shown.scene = scene;
    frame.tracked.state = engine::TrackingState::kSixDof;
    frame.tracked.camera_from_map.rotation = engine::Rotation3::Exp(Eigen::Vector3d(0.1, 0.4, -0.2));
    frame.tracked.camera_from_map.translation = {0.3, -0.2, 0.7};
    frame.visitor.emplace();
    frame.visitor->place = "Lions";
  }
  // Where an eye sees a point of the camera's axes, metres.
  Eigen::Vector2d Seen(std::size_t eye, const Eigen::Vector3d& in_camera_m) {
    EyeView eye_view;
    MakeEyeView(ViewOf(frame, camera), frame, display.eyes[eye], &eye_view);
    const Eigen::Vector3d in_map =
        frame.tracked.camera_from_map.inverse() * Eigen::Vector3d(in_camera_m / kMetresPerUnit);
    return *eye_view.view.camera->Project(*eye_view.view.seen_from_map * in_map);
  }

  const engine::CameraModel camera{
      engine::LensModel::kRadialTangential, {640, 480, 500, 500, 319.5, 239.5}, {}};
  DisplayCalibration display;
  ShownFrame frame;
};

TEST(EyeView, HasTheDisparityOfTheDistance) {
  Wearer wearer;
  for (const double distance_m : {0.7, 2.0, 8.0}) {
    const Eigen::Vector3d point(0.1, -0.05, distance_m);
    const Eigen::Vector2d apart = wearer.Seen(0, point) - wearer.Seen(1, point);
    EXPECT_NEAR(apart.x(), 1400 * kEyes_m / distance_m, 1e-6);
    EXPECT_NEAR(apart.y(), 0, 1e-9);
  }
}

TEST(EyeView, SeesFromTheCameraWithoutAScale) {
  Wearer wearer;
  auto scene = std::make_shared<content::Scene>();
  wearer.frame.shown.scene = scene;
  EXPECT_LT((wearer.Seen(0, {0.1, 0, 2}) - wearer.Seen(1, {0.1, 0, 2})).norm(), 1e-9);
}

TEST(EyeView, IsOnBlackAndKeepsTheWordsButNotThePlacesInTheCamerasImage) {
  Wearer wearer;
  wearer.frame.visitor->targets = {{"mask", {1, 2}, {3, 4}}};
  wearer.frame.visitor->marked = 0;
  EyeView eye_view;
  MakeEyeView(ViewOf(wearer.frame, wearer.camera), wearer.frame, wearer.display.eyes[0], &eye_view);
  EXPECT_FALSE(eye_view.view.shows_video);
  EXPECT_EQ(eye_view.view.overlay.visitor->place, "Lions");
  EXPECT_TRUE(eye_view.view.overlay.visitor->targets.empty());
  EXPECT_FALSE(eye_view.view.overlay.visitor->marked);
  wearer.frame.tracked.state = engine::TrackingState::kLost;
  MakeEyeView(ViewOf(wearer.frame, wearer.camera), wearer.frame, wearer.display.eyes[0], &eye_view);
  EXPECT_EQ(eye_view.view.seen_from_map, nullptr) << "nothing is drawn from a pose that is not known";
}

TEST(EyeView, PointsTheWayFromTheEye) {
  Wearer wearer;
  ShownWay way;
  way.towards = Eigen::Vector3d(1, 0, 0.2).normalized();
  way.drawn.text = "To the lions";
  wearer.frame.way = way;
  EyeView eye_view;
  MakeEyeView(ViewOf(wearer.frame, wearer.camera), wearer.frame, wearer.display.eyes[1], &eye_view);
  ASSERT_TRUE(eye_view.view.overlay.visitor->way_on);
  EXPECT_GT(eye_view.view.overlay.visitor->way_on->arrow.direction.x(), 0.99);
  EXPECT_GT(eye_view.view.overlay.visitor->way_on->arrow.tip.x(), 1200);
  EXPECT_EQ(eye_view.view.overlay.visitor->way_on->text, "To the lions");
}

}  // namespace
}  // namespace docent::app

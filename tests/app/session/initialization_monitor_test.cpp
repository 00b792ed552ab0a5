// SPDX-License-Identifier: Apache-2.0
#include "engine/system/initialization_monitor.h"

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <optional>

namespace docent::app {
namespace {

std::shared_ptr<const engine::MapSnapshot> MapWithDepth() {
  auto map = std::make_shared<engine::MapSnapshot>();
  map->keyframes.emplace_back().mean_depth = 2;
  map->points.emplace_back();
  return map;
}

// 1.5 seconds. The inlier ratio falls from 0.9 to `last`, and the camera moves by this distance (map units)
// and rotation (radians).
std::optional<engine::InitializationMonitor::Fault> FaultAfter(double last, double distance, double turn,
                                                               double rate_hz = 30) {
  engine::InitializationMonitor monitor;
  const auto map = MapWithDepth();
  const int images = static_cast<int>(1.5 * rate_hz);
  for (int i = 0; i <= images; ++i) {
    const double part = i / static_cast<double>(images);
    engine::TrackedFrame frame;
    frame.frame.time = FromSeconds(i / rate_hz);
    frame.state = engine::TrackingState::kSixDof;
    frame.map = map;
    frame.finite_points = 100;
    frame.quality = 0.9 + part * (last - 0.9);
    frame.camera_from_map =
        engine::Rigid3(engine::Rotation3::Exp({0, part * turn, 0}), Eigen::Vector3d(part * distance, 0, 0));
    monitor.Add(frame);
  }
  return monitor.FindFault();
}

TEST(InitializationMonitor, ReportsAMapWhosePointsAreLostWhileTheCameraHardlyMoves) {
  const auto fault = FaultAfter(0.1, 0.05, 0.05);
  ASSERT_TRUE(fault);
  EXPECT_GT(fault->initial_inlier_ratio, 0.8);
  EXPECT_LT(fault->recent_inlier_ratio, 0.4 * fault->initial_inlier_ratio);
}

TEST(InitializationMonitor, ReportsItFromFewImagesASecondToo) {
  for (const double rate_hz : {15.0, 10.0, 8.0, 6.0}) {
    EXPECT_TRUE(FaultAfter(0.1, 0.05, 0.05, rate_hz)) << rate_hz;
    EXPECT_FALSE(FaultAfter(0.7, 0.05, 0.05, rate_hz)) << rate_hz;
  }
}

TEST(InitializationMonitor, AcceptsAMapWhosePointsAreStillFound) {
  EXPECT_FALSE(FaultAfter(0.7, 0.05, 0.05));
}

TEST(InitializationMonitor, IgnoresPointsThatTheCameraMovedAwayFrom) {
  EXPECT_FALSE(FaultAfter(0.1, 2.0, 0.0)) << "walked away";
  EXPECT_FALSE(FaultAfter(0.1, 0.05, 1.0)) << "turned away";
}

// The camera moves to the right by a hundredth of the depth from image to image, and relocalizes there or
// elsewhere.
std::optional<engine::InitializationMonitor::Fault> JumpAfter(
    double x, double seconds, const std::function<void(engine::TrackedFrame*)>& change = nullptr) {
  engine::InitializationMonitor monitor;
  engine::TrackedFrame frame;
  frame.state = engine::TrackingState::kSixDof;
  frame.map = MapWithDepth();
  frame.finite_points = 100;
  frame.quality = 0.8;
  const auto add = [&](double center_x, double time) {
    frame.frame.time = FromSeconds(time);
    frame.camera_from_map.translation = {-2 * center_x, 0, 0};  // The depth is 2.
    monitor.Add(frame);
  };
  for (int i = 0; i < 10; ++i) add(0.01 * i, 0.03 * i);
  EXPECT_FALSE(monitor.FindJump());
  frame.state = engine::TrackingState::kRelocalized;
  if (change) change(&frame);
  add(x, 0.27 + seconds);
  return monitor.FindJump();
}

TEST(InitializationMonitor, ReportsACameraThatRelocalizesFarFromItsLastPosition) {
  const auto jump = JumpAfter(0.09 + 0.01 + 0.06, 0.03);
  ASSERT_TRUE(jump);
  EXPECT_NEAR(jump->jump, 0.06, 1e-9);
  EXPECT_TRUE(JumpAfter(-0.1, 0.03));
}

TEST(InitializationMonitor, AcceptsACameraThatRelocalizesWhereItMovedTo) {
  EXPECT_FALSE(JumpAfter(0.09 + 0.01 + 0.04, 0.03));
  EXPECT_FALSE(JumpAfter(0.09 + 0.06 + 0.04, 0.18)) << "it moved on at its speed";
  EXPECT_FALSE(JumpAfter(0.5, 0.3)) << "it was lost for too long";
}

TEST(InitializationMonitor, TakesNoJumpAsEvidenceWhereTheViewingDirectionJumpsAsWell) {
  const auto turned_by = [](double radians) {
    return [=](engine::TrackedFrame* frame) {
      frame->camera_from_map.rotation = engine::Rotation3::Exp({0, 0, radians});
    };
  };
  EXPECT_TRUE(JumpAfter(-0.5, 0.03, turned_by(0.16)));
  EXPECT_FALSE(JumpAfter(-0.5, 0.03, turned_by(0.18)));
}

TEST(InitializationMonitor, ComparesOnlyPositionsOfOneCamera) {
  EXPECT_FALSE(JumpAfter(0.5, 0.03, [](engine::TrackedFrame* frame) { frame->frame.camera = 1; }));
  EXPECT_FALSE(JumpAfter(0.5, 0.03, [](engine::TrackedFrame* frame) { frame->finite_points = 0; }));
}

TEST(InitializationMonitor, ReportsNothingBeforeTheFirstFrame) {
  engine::InitializationMonitor monitor;
  EXPECT_FALSE(monitor.FindFault());
  monitor.Add(engine::TrackedFrame());
  EXPECT_FALSE(monitor.FindFault());
}

}  // namespace
}  // namespace docent::app

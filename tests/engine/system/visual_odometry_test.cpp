// SPDX-License-Identifier: Apache-2.0
// Tests of visual odometry: a visitor walks along a wall of which only the beginning is mapped.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "engine/system/system.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;
using testing_world::RenderedWorld;

constexpr double kStep = 0.03;  // metres per image
constexpr int kMapped = 40;     // images in which the camera is near the keyframes

const RenderedWorld& LongWall() {
  static const RenderedWorld world({testing_world::PaintedWall({3, 0, 2}, Eigen::Vector3d::UnitX(),
                                                               Eigen::Vector3d::UnitY(), 7, 2, /*seed=*/5)});
  return world;
}

// The same wall, and another one at a right angle, three metres to the right, that is not mapped.
const RenderedWorld& Corner() {
  static const RenderedWorld world(
      {LongWall().walls().front(), testing_world::PaintedWall({3, 0, 0}, Eigen::Vector3d::UnitZ(),
                                                              Eigen::Vector3d::UnitY(), 4, 2, /*seed=*/6)});
  return world;
}

// Three keyframes, 15 cm apart.
const std::shared_ptr<const MapSnapshot>& BeginningOfTheWall() {
  static const std::shared_ptr<const MapSnapshot> map =
      testing_world::TrueMap(LongWall(), Camera(),
                             {CameraAt({0, 0, 0}), CameraAt({0.15, 0, 0}), CameraAt({0.3, 0, 0})}, 400)
          .Snapshot();
  return map;
}

// The camera's place in each image: to the right, with a slight sway, until no point of the map is in view.
Rigid3 PoseOf(int image) {
  return CameraAt({kStep * image, 0.03 * std::sin(0.1 * image), 0.04 * std::sin(0.07 * image)},
                  {0, 2 * std::sin(0.05 * image), 0});
}

class VisualOdometryTest : public testing::Test {
 protected:
  explicit VisualOdometryTest(double max_odometry_s = 10, bool threaded = false) {
    SystemOptions options;
    options.threaded = threaded;
    options.extend_maps = false;
    options.tracker.max_odometry_s = max_odometry_s;
    system_ = std::make_unique<System>(options, std::vector{Camera()});
    system_->AddMap(1, BeginningOfTheWall(), MapPermissions());
    system_->place_index().SetMap(1, BeginningOfTheWall());
  }

  // Processes the image that the camera takes there.
  const TrackedFrame& Look(const Rigid3& pose) {
    last_ = system_->Process(testing_world::MakeFrame(time_++, LongWall(), pose));
    error_ = (last_.camera_from_map.OriginInSource() - pose.OriginInSource()).norm();
    return last_;
  }
  void WalkTo(int image) {
    for (; at_ < image; ++at_) Look(PoseOf(at_));
  }

  std::unique_ptr<System> system_;
  TrackedFrame last_;
  double error_ = 0;  // metres, of last_
  int time_ = 0, at_ = 0;
};

TEST_F(VisualOdometryTest, CarriesThePoseOnWhereNothingIsMapped) {
  int by_odometry = 0;
  double longest = 0;
  for (int i = 0; i < 160; ++i) {
    const TrackedFrame& frame = Look(PoseOf(i));
    if (i < 10) continue;  // until it is recognized
    ASSERT_TRUE(HasPose(frame.state)) << i;
    EXPECT_EQ(frame.map_key, 1u);
    EXPECT_EQ(frame.map, BeginningOfTheWall()) << "the map itself must not change";
    by_odometry += frame.by_odometry;
    EXPECT_TRUE(!frame.by_odometry || frame.matches.empty()) << i;
    longest = std::max(longest, error_);
  }
  EXPECT_TRUE(last_.by_odometry);
  EXPECT_GT(by_odometry, 30);
  EXPECT_LT(longest, 0.03 * kStep * 160) << "3 % of the way";
}

TEST_F(VisualOdometryTest, ReturnsToTheMapWithoutALoss) {
  WalkTo(150);
  ASSERT_TRUE(last_.by_odometry);
  for (int i = 150; i > 5; --i) {
    const TrackedFrame& frame = Look(PoseOf(i));
    ASSERT_TRUE(HasPose(frame.state)) << i;
    EXPECT_NE(frame.state, TrackingState::kRelocalized) << i;
  }
  EXPECT_FALSE(last_.by_odometry);
  EXPECT_LT(error_, 0.01);
}

TEST_F(VisualOdometryTest, IsNotNeededWhereTheMapShowsEnough) {
  for (int i = 0; i < kMapped / 2; ++i) EXPECT_FALSE(Look(PoseOf(i)).by_odometry) << i;
}

TEST_F(VisualOdometryTest, EndsWhenTheImageChangesAltogether) {
  WalkTo(150);
  ASSERT_TRUE(last_.by_odometry);
  const RenderedWorld elsewhere = RenderedWorld::Room(8);
  int posed = 0;
  for (int i = 0; i < 30; ++i)
    posed +=
        HasPose(system_->Process(testing_world::MakeFrame(time_++, elsewhere, CameraAt({0, 0, 0}))).state);
  EXPECT_EQ(posed, 0);
}

// Beyond the map there is no parallax: a panorama map continues the rotation.
TEST_F(VisualOdometryTest, ContinuesTheRotationOfAVisitorWhoTurnsOnTheSpot) {
  const Eigen::Vector3d center(0.6, 0, 0);
  constexpr int kTurnDeg = 100;
  const auto look_towards = [&](int heading_deg) {
    const Rigid3 pose = CameraAt(center, {0, static_cast<double>(heading_deg), 0});
    last_ = system_->Process(testing_world::MakeFrame(time_++, Corner(), pose));
    return (last_.camera_from_map.rotation * pose.rotation.inverse()).Angle() * 180 / std::numbers::pi;
  };
  for (int i = 0; i < 20; ++i) look_towards(0);
  ASSERT_TRUE(HasPose(last_.state));
  for (int i = 0; i <= 2 * kTurnDeg; ++i) {
    const double error_deg = look_towards(std::min(i, 2 * kTurnDeg - i));
    ASSERT_TRUE(HasPose(last_.state)) << i;
    EXPECT_NE(last_.state, TrackingState::kRelocalized) << i;
    EXPECT_LT(error_deg, 1) << i;
  }
  EXPECT_FALSE(last_.by_odometry);
}

// Two cameras of one visitor share the copy of the map.
TEST(VisualOdometryOfTwoCameras, GoesOnWhenTheOtherCameraIsRecognizedInTheMap) {
  SystemOptions options;
  options.threaded = false;
  options.extend_maps = false;
  System system(options, std::vector{Camera(), Camera()});
  system.AddMap(1, BeginningOfTheWall(), MapPermissions());
  system.place_index().SetMap(1, BeginningOfTheWall());
  constexpr int kOdometry = 130, kBack = 135, kEnd = 160;
  int recognized = 0;
  for (int i = 0; i < kEnd; ++i) {
    const TrackedFrame first = system.Process(testing_world::MakeFrame(i, LongWall(), PoseOf(i)));
    Frame frame = i < kBack ? testing_world::MakeFrame(
                                  i, cv::Mat::zeros(Camera()->height_px(), Camera()->width_px(), CV_8UC1))
                            : testing_world::MakeFrame(i, LongWall(), PoseOf(20));
    frame.camera = 1;
    recognized += HasPose(system.Process(frame).state);
    if (i < kOdometry) continue;
    EXPECT_TRUE(HasPose(first.state) && first.by_odometry) << i;
  }
  EXPECT_GT(recognized, 10);
}

class ShortVisualOdometry : public VisualOdometryTest {
 protected:
  ShortVisualOdometry() : VisualOdometryTest(/*max_odometry_s=*/0.5) {}
};

TEST_F(ShortVisualOdometry, EndsAfterItsLongestTime) {
  int in_a_row = 0, longest = 0;
  for (int i = 0; i < 200; ++i) {
    in_a_row = Look(PoseOf(i)).by_odometry ? in_a_row + 1 : 0;
    longest = std::max(longest, in_a_row);
  }
  EXPECT_FALSE(HasPose(last_.state));
  EXPECT_GE(longest, 10);
  EXPECT_LE(longest, 15) << "half a second";
}

class ThreadedVisualOdometry : public VisualOdometryTest {
 protected:
  ThreadedVisualOdometry() : VisualOdometryTest(/*max_odometry_s=*/10, /*threaded=*/true) {}
};

// How far the odometry goes depends on how fast the mapper is; what the map shows does not.
TEST_F(ThreadedVisualOdometry, FindsTheMapAgain) {
  for (int walk = 0; walk < 2; ++walk) {
    for (int i = 0; i < 100; ++i) Look(PoseOf(i));
    for (int i = 100; i > 5; --i) EXPECT_EQ(Look(PoseOf(i)).map, BeginningOfTheWall()) << i;
    EXPECT_TRUE(HasPose(last_.state));
    EXPECT_LT(error_, 0.01);
  }
}

class NoVisualOdometry : public VisualOdometryTest {
 protected:
  NoVisualOdometry() : VisualOdometryTest(/*max_odometry_s=*/0) {}
};

TEST_F(NoVisualOdometry, LosesTheCameraWhereNothingIsMapped) {
  int by_odometry = 0;
  for (int i = 0; i < 200; ++i) by_odometry += Look(PoseOf(i)).by_odometry;
  EXPECT_EQ(by_odometry, 0);
  EXPECT_FALSE(HasPose(last_.state));
}

}  // namespace
}  // namespace docent::engine

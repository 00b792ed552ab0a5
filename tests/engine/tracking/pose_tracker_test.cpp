// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/pose_tracker.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <utility>
#include <vector>

#include "tests/engine/tracking/tracked_image.h"

namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;
using testing_world::ImageAt;
using testing_world::RenderedWorld;
using testing_world::World;
using Outcome = PoseTracker::Estimate::Outcome;

class KnownRoom : public ::testing::Test {
 public:
  explicit KnownRoom(const TrackerOptions& options = {}) : tracker_(options, Camera()) {}

  static Rigid3 Pose(int frame) { return CameraAt({0.01 * frame, 0, 0}, {0, 0.2 * frame, 0}); }
  static const std::shared_ptr<const MapSnapshot>& TheMap() {
    static const auto map =
        testing_world::TrueMap(World(), Camera(), {CameraAt({0, 0, 0}), CameraAt({0.2, 0, 0})}).Snapshot();
    return map;
  }
  PoseTracker::Estimate Track(const CameraImage& image) {
    return tracker_.Track(*TheMap(), image, std::nullopt, policy_, &random_);
  }
  void Walk(int frames) {
    tracker_.Begin(ImageAt(Pose(0)).time, Pose(0), ObservedMotion::kSixDof);
    for (int i = 1; i <= frames; ++i) {
      const CameraImage image = ImageAt(Pose(i), i);
      const auto estimate = Track(image);
      ASSERT_EQ(estimate.outcome, Outcome::kPose) << i;
      tracker_.Accept(image, estimate.result, false);
    }
  }

  PoseTracker tracker_;
  KeyFramePolicy policy_{KeyFramePolicyOptions(), 1.3};
  Random random_{1};
};

TEST_F(KnownRoom, IsTrackedFromFrameToFrame) {
  Walk(8);
  EXPECT_LT((tracker_.last().OriginInSource() - Pose(8).OriginInSource()).norm(), 0.01);
  EXPECT_NEAR(tracker_.rotation_rate().norm(), 0.2 * M_PI / 180, 0.002);
  EXPECT_NEAR(tracker_.median_depth(), 2.5, 1);
}

TEST_F(KnownRoom, KeepsItsMotionWhereEachImageIsDeliveredTwice) {
  tracker_.Begin(ImageAt(Pose(0)).time, Pose(0), ObservedMotion::kSixDof);
  for (int i = 1; i <= 16; ++i) {
    CameraImage image = ImageAt(Pose(i / 2 * 2), i);
    image.is_repeated = i % 2 != 0;
    const auto estimate = Track(image);
    ASSERT_EQ(estimate.outcome, Outcome::kPose) << i;
    EXPECT_LT((estimate.result.camera_from_map.OriginInSource() - Pose(i / 2 * 2).OriginInSource()).norm(),
              0.01);
    tracker_.Accept(image, estimate.result, false);
    if (i < 2) continue;
    // Two steps of 0.2 degrees from one image to the next one that differs.
    EXPECT_NEAR(tracker_.rotation_rate().norm(), 0.4 * M_PI / 180, 0.004) << i;
  }
}

TEST_F(KnownRoom, IsLostWhenTheImageShowsNothingOfIt) {
  Walk(4);
  const RenderedWorld other = RenderedWorld::Room(7177);
  EXPECT_EQ(Track(ImageAt(Pose(5), 5, other)).outcome, Outcome::kLost);
}

TEST_F(KnownRoom, IsFoundAgainFromThePoseBeforeTheLoss) {
  Walk(4);
  CameraImage image = ImageAt(Pose(5), 5);
  tracker_.Lose(image.time);
  image = ImageAt(Pose(6), 6);
  const Rigid3 guess = tracker_.PredictAfterLoss(image);
  const auto result =
      tracker_.TryFrom(*TheMap(), image, guess, MapTracker::Effort::kRelocalization, &random_);
  EXPECT_LT((result.camera_from_map.OriginInSource() - Pose(6).OriginInSource()).norm(), 0.01);
}

// Tracks a camera that turns away from all points of the map, and on slowly, while it moves by this much for
// each image. Returns for how many images the rotation alone was tracked before the camera was lost.
int FramesByRotation(KnownRoom* room, double motion) {
  constexpr int kFrames = 80;
  int by_rotation = 0;
  std::shared_ptr<const ImageFeatures> previous;
  for (int i = 1; i < kFrames; ++i) {
    const double turn_deg = -std::min(2.0 * i, 72 + 0.05 * i);
    CameraImage image = ImageAt(CameraAt({motion * i, 0, 0}, {0, turn_deg, 0}), i);
    image.previous = std::exchange(previous, image.features);
    const auto estimate = room->Track(image);
    if (estimate.outcome == Outcome::kLost) return by_rotation;
    by_rotation += estimate.outcome == Outcome::kRotationOnly;
    room->tracker_.Accept(image, estimate.result, false);
  }
  return by_rotation;
}

TEST_F(KnownRoom, IsTrackedByTheRotationWhileTheCameraStandsAndTurnsAway) {
  tracker_.Begin(ImageAt(Pose(0)).time, Pose(0), ObservedMotion::kSixDof);
  EXPECT_GT(FramesByRotation(this, 0), 35);
  EXPECT_LT(tracker_.last().OriginInSource().norm(), 0.02);
}

TEST_F(KnownRoom, IsLostSoonWhenTheCameraWalksAwayAndTurns) {
  tracker_.Begin(ImageAt(Pose(0)).time, Pose(0), ObservedMotion::kSixDof);
  // 0.6 units a second at a depth of 2.5 are a fifth of the depth after 0.8 s, or 25 images.
  const int frames = FramesByRotation(this, -0.02);
  EXPECT_GE(frames, 18);
  EXPECT_LE(frames, 32);
}

// A camera with a rolling shutter that pans over the known room, in maps whose images were taken while it
// turned at another rate, and which tell no readout time yet.
class RollingShutterInKnownRoom : public KnownRoom {
 public:
  using KnownRoom::KnownRoom;
  static constexpr double kReadout_s = 0.02, kSlow = 0.05, kFast = 0.7;  // radians per second

  static std::shared_ptr<const CameraModel> Turning(double rate, double readout_s) {
    return std::make_shared<CameraModel>(CameraModel::WithReadout(Camera(), {{0, -rate, 0}, {0, readout_s}}));
  }
  static std::shared_ptr<const MapSnapshot> MapFromImagesThatTurned(double rate) {
    const std::vector<Rigid3> poses = {CameraAt({0, 0, 0}), CameraAt({0.2, 0, 0})};
    return testing_world::TrueMap(World(), Turning(rate, 0), poses).Snapshot();
  }
  static Rigid3 PanPose(int frame) {
    return CameraAt({0.01 * frame, 0, 0}, {0, kFast * frame / 30 * 180 / M_PI - 8, 0});
  }
  // Pans from one frame to another one, and returns the largest error of a position in the last five frames.
  double Pan(const MapSnapshot& map, int from, int to) {
    double largest = 0;
    for (int i = from; i <= to; ++i) {
      CameraImage image;
      const cv::Mat pixels = World().Render(*Turning(kFast, kReadout_s), PanPose(i), 1.5, i);
      const Frame frame = testing_world::MakeFrame(i, pixels);
      image.time = frame.time;
      image.camera = Camera();
      image.features = MakeFeatures(frame.image);
      const auto estimate = tracker_.Track(map, image, std::nullopt, policy_, &random_);
      EXPECT_EQ(estimate.outcome, Outcome::kPose) << i;
      tracker_.Accept(image, estimate.result, false);
      const double error = (tracker_.last().OriginInSource() - PanPose(i).OriginInSource()).norm();
      if (i > to - 5) largest = std::max(largest, error);
    }
    return largest;
  }
  void SetUp() override { tracker_.Begin(ImageAt(PanPose(0)).time, PanPose(0), ObservedMotion::kSixDof); }
};

TEST_F(RollingShutterInKnownRoom, TheReadoutTimeIsFoundInAMapFromImagesThatHardlyTurned) {
  const double error = Pan(*MapFromImagesThatTurned(kSlow), 1, 12);
  EXPECT_NEAR(tracker_.readout_s().y(), kReadout_s, 0.004);
  EXPECT_DOUBLE_EQ(tracker_.readout_s().x(), 0);
  EXPECT_LT(error, 0.005);
}

TEST_F(RollingShutterInKnownRoom, TheReadoutTimeIsLeftToTheMapperIfItHasImagesThatTurnedAsFast) {
  Pan(*MapFromImagesThatTurned(kFast), 1, 12);
  EXPECT_EQ(tracker_.readout_s(), Eigen::Vector2d::Zero());
}

class UnknownCalibrationInKnownRoom : public RollingShutterInKnownRoom {
 public:
  static TrackerOptions Options() {
    TrackerOptions options;
    options.initializer.estimate_readout = false;
    return options;
  }
  UnknownCalibrationInKnownRoom() : RollingShutterInKnownRoom(Options()) {}
};

TEST_F(UnknownCalibrationInKnownRoom, NoReadoutTimeIsEstimated) {
  Pan(*MapFromImagesThatTurned(kSlow), 1, 12);
  EXPECT_EQ(tracker_.readout_s(), Eigen::Vector2d::Zero());
}

TEST_F(RollingShutterInKnownRoom, AnEstimateEndsWhenTheMapperFindsNoneInFasterImages) {
  Pan(*MapFromImagesThatTurned(kSlow), 1, 8);
  ASSERT_GT(tracker_.readout_s().y(), 0);
  Pan(*MapFromImagesThatTurned(kFast), 9, 12);
  EXPECT_EQ(tracker_.readout_s(), Eigen::Vector2d::Zero());
}

// A camera whose last row is exposed 30 ms after the first, and which sees the known room in the upper half
// of the image only: its points were exposed 10 ms before the moment of the pose.
class RollingShutterOverAWall : public KnownRoom {
 public:
  static constexpr double kReadout_s = 0.03;

  static Rigid3 SwayingPose(int frame) {
    return CameraAt({0.005 * frame, 0, 0}, {2 * std::sin(0.2 * frame), 3 * std::sin(0.15 * frame), 0});
  }
  static std::shared_ptr<const CameraModel> Lens() {
    static const auto lens = std::make_shared<const CameraModel>(Camera()->WithKnownReadout({0, kReadout_s}));
    return lens;
  }
  static cv::Mat UpperThird(int frame) {
    const double interval_s = ToSeconds(ImageAt(Pose(1), 1).time - ImageAt(Pose(0), 0).time);
    const Rotation3 turn = SwayingPose(frame + 1).rotation * SwayingPose(frame - 1).rotation.inverse();
    const CameraModel image =
        CameraModel::WithReadout(Lens(), {turn.Log() / (2 * interval_s), {0, kReadout_s}});
    cv::Mat pixels = World().Render(image, SwayingPose(frame), 1.5, frame);
    pixels.rowRange(pixels.rows / 3, pixels.rows).setTo(128);
    return pixels;
  }
};

TEST_F(RollingShutterOverAWall, ThePosesDoNotSwingFromImageToImage) {
  constexpr int kFrames = 60;
  PoseTracker tracker({}, Lens());
  tracker.Begin(ImageAt(SwayingPose(0)).time, SwayingPose(0), ObservedMotion::kSixDof);
  double sum = 0;
  for (int i = 1; i <= kFrames; ++i) {
    const Frame frame = testing_world::MakeFrame(i, UpperThird(i));
    CameraImage image;
    image.time = frame.time;
    image.camera = Lens();
    image.features = MakeFeatures(frame.image);
    const auto estimate = tracker.Track(*TheMap(), image, std::nullopt, policy_, &random_);
    ASSERT_EQ(estimate.outcome, Outcome::kPose) << i;
    const Rotation3 before = tracker.last().rotation;
    tracker.Accept(image, estimate.result, false);
    const Rotation3 error = tracker.last().rotation * before.inverse() * SwayingPose(i - 1).rotation *
                            SwayingPose(i).rotation.inverse();
    sum += error.Log().squaredNorm();
  }
  EXPECT_LT(std::sqrt(sum / kFrames) / Camera()->PixelAngle(), 0.25) << "pixels";
}

TEST_F(KnownRoom, AlternatesThePatchComparison) {
  EXPECT_EQ(tracker_.comparison(), PatchComparison::kStandard);
  tracker_.AlternateComparison();
  EXPECT_EQ(tracker_.comparison(), PatchComparison::kTolerant);
  tracker_.AlternateComparison();
  EXPECT_EQ(tracker_.comparison(), PatchComparison::kStandard);
}

}  // namespace
}  // namespace docent::engine

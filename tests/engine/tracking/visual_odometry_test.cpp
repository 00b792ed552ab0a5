// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/visual_odometry.h"

#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <vector>

#include "tests/engine/tracking/tracked_image.h"

namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;
using testing_world::ImageAt;

// A camera that turns before a distant wall: a hundred finite points determine its rotation only.
class TurnBeforeADistantWall : public ::testing::Test {
 protected:
  TurnBeforeADistantWall() {
    KeyFrame keyframe;
    keyframe.id = 4;
    map_->keyframes.push_back(keyframe);
    result_.camera_from_map = pose_;
    result_.observed = ObservedMotion::kPanorama;
    result_.median_depth = 6;
    result_.inliers = result_.finite_inliers = 100;
    result_.finite_coverage = result_.coverage = 1;
    matches_.resize(100);
    for (PointMatch& match : matches_) match.inlier = true;
  }

  // A pose that the points of the map determine.
  void Track(bool rotation_center) {
    for (int i = 0; i < 10 && !offered_; ++i) {
      odometry_.BeginFrame();
      odometry_.AddMapPose(
          image_, *map_, {{result_, matches_, kNoId, result_.median_depth}, /*good=*/true, rotation_center});
      offered_ = odometry_.offers().Take();
    }
  }
  // Whether the odometry goes on from that pose when the map no longer determines the next one.
  bool GoesOn() {
    odometry_.SetCopy(map_);
    PoseTracker lost(TrackerOptions(), Camera());
    lost.Begin(image_.time, result_.camera_from_map, result_.observed);
    odometry_.Begin(lost);
    return odometry_.is_active();
  }

  const Rigid3 pose_ = CameraAt({0, 0, 0}, {0, 20, 0});
  const CameraImage image_ = ImageAt(pose_, 30);
  const std::shared_ptr<MapSnapshot> map_ = std::make_shared<MapSnapshot>();
  MapTrackResult result_;
  std::vector<PointMatch> matches_;
  VisualOdometry odometry_{TrackerOptions(), Camera()};
  std::optional<KeyFrameCandidate> offered_;
};

TEST_F(TurnBeforeADistantWall, ExtendsTheCopyWhereTheRotationCenterIsKnown) {
  Track(/*rotation_center=*/true);
  ASSERT_TRUE(offered_);
  EXPECT_EQ(offered_->choice, KeyFrameChoice::kSixDof);
  EXPECT_EQ(offered_->matches.size(), 100u);
  EXPECT_TRUE(GoesOn());
}

TEST_F(TurnBeforeADistantWall, HasNoPositionWhereTheRotationCenterIsUnknown) {
  Track(/*rotation_center=*/false);
  EXPECT_FALSE(offered_);
  EXPECT_FALSE(GoesOn());
}

TEST_F(TurnBeforeADistantWall, HasNoPositionWithFewPoints) {
  result_.inliers = result_.finite_inliers = 20;
  Track(/*rotation_center=*/true);
  EXPECT_FALSE(offered_);
  EXPECT_FALSE(GoesOn());
}

// Infinite points may be those of a panorama map elsewhere.
TEST_F(TurnBeforeADistantWall, HasNoPositionWhereInfinitePointsWereFoundToo) {
  result_.finite_inliers = 60;
  Track(/*rotation_center=*/true);
  EXPECT_FALSE(offered_);
  EXPECT_FALSE(GoesOn());
}

}  // namespace
}  // namespace docent::engine

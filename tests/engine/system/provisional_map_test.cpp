// SPDX-License-Identifier: Apache-2.0
#include "engine/system/provisional_map.h"

#include <gtest/gtest.h>

#include <memory>

namespace docent::engine {
namespace {

using Reason = MapDiscarded::Reason;

// A map of one keyframe that got finite points at one second.
class NewMap : public ::testing::Test {
 protected:
  NewMap() {
    map_->keyframes.emplace_back().mean_depth = 2;
    map_->points.emplace_back().point_in_map << 0, 0, 2, 1;
    provisional_.Begin(FromSeconds(1));
  }
  // The camera is tracked with this inlier ratio.
  std::optional<MapDiscarded> Track(double seconds, double quality = 0.8, int camera = 0) {
    TrackedFrame frame;
    frame.frame.camera = camera;
    frame.frame.time = FromSeconds(seconds);
    frame.state = TrackingState::kSixDof;
    frame.map = map_;
    frame.finite_points = 100;
    frame.quality = quality;
    return provisional_.Check(
        options_, {.frame = frame, .in_map = true, .map = map_.get(), .may_discard = may_discard_});
  }
  // The camera relocalizes this far from the origin, where it was tracked.
  std::optional<MapDiscarded> Relocalize(double seconds, double distance) {
    TrackedFrame frame;
    frame.frame.time = FromSeconds(seconds);
    frame.state = TrackingState::kRelocalized;
    frame.map = map_;
    frame.camera_from_map.translation = {distance, 0, 0};
    frame.finite_points = 100;
    frame.quality = 0.8;
    return provisional_.Check(
        options_, {.frame = frame, .in_map = true, .map = map_.get(), .may_discard = may_discard_});
  }
  std::optional<MapDiscarded> Lose(double seconds, double since) {
    TrackedFrame frame;
    frame.frame.time = FromSeconds(seconds);
    frame.state = TrackingState::kLost;
    return provisional_.Check(
        options_,
        {.frame = frame, .map = map_.get(), .lost_since = FromSeconds(since), .may_discard = may_discard_});
  }

  ProvisionalMapOptions options_;
  std::shared_ptr<MapSnapshot> map_ = std::make_shared<MapSnapshot>();
  ProvisionalMap provisional_;
  bool may_discard_ = true;
};

TEST_F(NewMap, IsNotFalseBecauseAnotherCameraSeesLessOfIt) {
  for (int i = 0; i < 8; ++i) EXPECT_FALSE(Track(1.05 + i / 30.0));
  for (int i = 0; i < 20; ++i) EXPECT_FALSE(Track(1.35 + i / 30.0, 0.2, 1)) << i;
  for (int i = 0; i < 20; ++i) {
    if (Track(2.05 + i / 30.0, 0.2)) return;
  }
  ADD_FAILURE() << "the first camera lost most of its points";
}

TEST_F(NewMap, IsConfirmedByTime) {
  EXPECT_FALSE(Track(2.9));
  EXPECT_TRUE(provisional_.is_pending());
  EXPECT_FALSE(Track(3.1));
  EXPECT_FALSE(provisional_.is_pending());
  EXPECT_FALSE(Lose(9, 4)) << "it is no longer provisional";
}

TEST_F(NewMap, IsKeptWhileTheMapperGivesItDepth) {
  map_->points.clear();
  TrackedFrame lost;
  lost.frame.time = FromSeconds(3);
  lost.state = TrackingState::kLost;
  ProvisionalMap::Observation seen{
      .frame = lost, .map = map_.get(), .lost_since = FromSeconds(1.2), .starting = true};
  EXPECT_FALSE(provisional_.Check(options_, seen));
  seen.starting = false;
  const auto discarded = provisional_.Check(options_, seen);
  ASSERT_TRUE(discarded);
  EXPECT_EQ(discarded->reason, Reason::kLostWithoutDepth);
}

TEST_F(NewMap, IsConfirmedByKeyFrames) {
  map_->keyframes.resize(options_.keyframes);
  EXPECT_FALSE(Track(1.1));
  EXPECT_FALSE(provisional_.is_pending());
}

TEST_F(NewMap, IsDiscardedWhenTheCameraIsLostSoon) {
  EXPECT_FALSE(Track(1.2));
  EXPECT_FALSE(Lose(1.7, 1.3));
  const auto discarded = Lose(1.71, 1.3);
  ASSERT_TRUE(discarded);
  EXPECT_EQ(discarded->reason, Reason::kLostWhileProvisional);
  EXPECT_EQ(discarded->tracked_for, FromSeconds(1.3) - FromSeconds(1));
  EXPECT_EQ(discarded->keyframes, 1u);
}

TEST_F(NewMap, IsDiscardedWhenItsDepthIsFalse) {
  std::optional<MapDiscarded> discarded;
  for (int i = 0; i < 30 && !discarded; ++i) discarded = Track(1 + i / 30.0, i < 8 ? 0.8 : 0.1);
  ASSERT_TRUE(discarded);
  EXPECT_EQ(discarded->reason, Reason::kFalseDepth);
  EXPECT_GT(discarded->fault.initial_inlier_ratio, discarded->fault.recent_inlier_ratio);
}

TEST_F(NewMap, IsDiscardedWhenItContradictsItselfAlthoughItHasKeyFrames) {
  map_->keyframes.resize(options_.keyframes, map_->keyframes.front());
  EXPECT_FALSE(Track(1.1));
  EXPECT_FALSE(Track(1.2));
  EXPECT_FALSE(provisional_.is_pending());
  const auto discarded = Relocalize(1.3, 0.2);
  ASSERT_TRUE(discarded);
  EXPECT_EQ(discarded->reason, Reason::kFalseDepth);
  EXPECT_NEAR(discarded->fault.jump, 0.1, 1e-9) << "the depth is 2";
}

TEST_F(NewMap, MayCorrectThePoseLater) {
  for (const double seconds : {1.1, 2.9, 3.1}) EXPECT_FALSE(Track(seconds));
  EXPECT_FALSE(Relocalize(3.2, 0.2));
}

TEST_F(NewMap, IsKeptWhenItMayNotBeDiscarded) {
  may_discard_ = false;
  for (int i = 0; i < 30; ++i) EXPECT_FALSE(Track(1 + i / 30.0, i < 8 ? 0.8 : 0.1));
  EXPECT_FALSE(Lose(3, 2));
  EXPECT_FALSE(provisional_.is_pending());
}

TEST_F(NewMap, WithoutDepthIsDiscardedAfterAShortLoss) {
  map_->points.clear();
  ProvisionalMap not_initialized;
  std::swap(provisional_, not_initialized);
  EXPECT_FALSE(Lose(2.1, 2));
  const auto discarded = Lose(2.2, 2);
  ASSERT_TRUE(discarded);
  EXPECT_EQ(discarded->reason, Reason::kLostWithoutDepth);
}

TEST_F(NewMap, WithoutDepthIsKeptWhenItMayNotBeDiscarded) {
  map_->points.clear();
  may_discard_ = false;
  EXPECT_FALSE(Lose(2.2, 2));
  EXPECT_FALSE(provisional_.is_pending()) << "a lost camera would not start another map";
}

TEST(ProvisionalMapOptions, AreRefusedOutOfRange) {
  ProvisionalMapOptions options;
  EXPECT_FALSE(options.Validate());
  options.keyframes = 0;
  EXPECT_TRUE(options.Validate());
  options = {};
  options.panorama_loss_time = Timestamp(-1);
  EXPECT_TRUE(options.Validate());
}

}  // namespace
}  // namespace docent::engine

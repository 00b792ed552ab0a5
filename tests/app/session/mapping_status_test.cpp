// SPDX-License-Identifier: Apache-2.0
#include "app/session/mapping_status.h"

#include <gtest/gtest.h>

namespace docent::app {
namespace {

engine::TrackedFrame FrameAt(double seconds, double newest_keyframe) {
  auto map = std::make_shared<engine::MapSnapshot>();
  for (const double time : {0.5, newest_keyframe}) {
    map->keyframes.emplace_back();
    map->keyframes.back().time = FromSeconds(time);
  }
  engine::TrackedFrame frame;
  frame.frame.time = FromSeconds(seconds);
  frame.state = engine::TrackingState::kSixDof;
  frame.quality_class = engine::TrackingQuality::kGood;
  frame.map = map;
  return frame;
}

TEST(MappingStatus, IsStartingUntilThereIsAMap) {
  EXPECT_EQ(MappingStatusOf(engine::TrackedFrame(), true), MappingStatus::kStarting);
  EXPECT_STREQ(ToString(MappingStatus::kStarting), "starting");
}

TEST(MappingStatus, IsExtendingWhileKeyFramesAreAddedAndMappedAfterwards) {
  EXPECT_EQ(MappingStatusOf(FrameAt(5, 4), true), MappingStatus::kExtending);
  EXPECT_EQ(MappingStatusOf(FrameAt(5, 2), true), MappingStatus::kMapped);
  EXPECT_EQ(MappingStatusOf(FrameAt(5, 4), false), MappingStatus::kMapped)
      << "keyframes of an earlier session";
  EXPECT_EQ(MappingStatusOf(FrameAt(5, 60), true), MappingStatus::kMapped) << "keyframes of another clock";
}

TEST(MappingStatus, IsLimitedWhenTrackingIsNotGood) {
  engine::TrackedFrame frame = FrameAt(5, 4);
  frame.quality_class = engine::TrackingQuality::kPoor;
  EXPECT_EQ(MappingStatusOf(frame, true), MappingStatus::kLimited);
  frame = FrameAt(5, 4);
  for (const auto state :
       {engine::TrackingState::kLost, engine::TrackingState::kDropped, engine::TrackingState::kPanorama}) {
    frame.state = state;
    EXPECT_EQ(MappingStatusOf(frame, true), MappingStatus::kLimited) << engine::ToString(state);
  }
}

}  // namespace
}  // namespace docent::app

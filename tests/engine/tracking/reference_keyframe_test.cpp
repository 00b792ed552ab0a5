// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/reference_keyframe.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/tracking/tracker.h"
#include "tests/engine/rendered_world.h"
#include "tests/engine/some_maps.h"

// Tests of a tracker whose map is corrected while it tracks.
namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;
using testing_world::World;

Rigid3 SidewaysPose(int frame) {
  return CameraAt({0.01 * frame, 0.02 * std::sin(0.1 * frame), 0}, {0, -0.1 * frame, 0});
}

Frame SidewaysFrame(int index) {
  return testing_world::MakeFrame(index, World(), SidewaysPose(index));
}

// A tracker that has tracked the first frames in an exact map.
class MovedMap : public ::testing::Test {
 protected:
  static constexpr int kBefore = 12;
  static void SetUpTestSuite() {
    map_ = new Map(testing_world::TrueMap(
        World(), Camera(), {SidewaysPose(-20), SidewaysPose(0), SidewaysPose(20), SidewaysPose(40)}, 250));
  }
  static void TearDownTestSuite() {
    delete map_;
    map_ = nullptr;
  }
  void SetUp() override {
    tracker_.SetMap(before_, 1);
    testing_world::SomeMaps places;
    places.Add(1, before_);
    for (int i = 0; i < kBefore; ++i) last_ = tracker_.Track(SidewaysFrame(i), &places);
    ASSERT_TRUE(HasPose(last_.state)) << "the test needs a tracked camera";
  }
  // The correction: a scale of 1.5, a rotation and a translation.
  static Sim3 Correction() {
    Sim3 moved;
    moved.rotation = Rotation3::Exp({0.1, -0.4, 0.2});
    moved.translation = {0.5, 1.0, -2.0};
    moved.scale = 1.5;
    return moved;
  }
  std::shared_ptr<const MapSnapshot> After() const {
    Map moved(*before_);
    std::map<KeyFrameId, Sim3> by;
    for (const KeyFrame& keyframe : before_->keyframes) by[keyframe.id] = Correction();
    moved.Correct(by);
    return moved.Snapshot();
  }

  static Map* map_;
  std::shared_ptr<const MapSnapshot> before_ = map_->Snapshot();
  static TrackerOptions ReadOnlyOptions() {
    TrackerOptions options;
    options.build_maps = false;
    return options;
  }
  Tracker tracker_{ReadOnlyOptions(), Camera(), 5};
  TrackedFrame last_;
};
Map* MovedMap::map_ = nullptr;

TEST_F(MovedMap, TrackingContinuesAfterACorrection) {
  tracker_.SetMap(After(), 1);
  const TrackedFrame next = tracker_.Track(SidewaysFrame(kBefore), nullptr);
  ASSERT_EQ(next.state, TrackingState::kSixDof) << static_cast<int>(next.hint);
  // The map unit is two thirds of a metre now, so that the tolerance is 3 mm.
  EXPECT_TRUE(IsNear(next.camera_from_map, CorrectedPose(SidewaysPose(kBefore), Correction()), 0.0045, 0.003))
      << next.camera_from_map;
}

TEST_F(MovedMap, TrackingIsLostWithoutTheCorrectionRecord) {
  MapSnapshot without_corrections = *After();
  without_corrections.corrections.clear();
  tracker_.SetMap(std::make_shared<MapSnapshot>(without_corrections), 1);
  EXPECT_FALSE(HasPose(tracker_.Track(SidewaysFrame(kBefore), nullptr).state));
}

TEST_F(MovedMap, TheSameCorrectionIsAppliedOnlyOnce) {
  tracker_.SetMap(After(), 1);
  tracker_.SetMap(After(), 1);
  EXPECT_EQ(tracker_.Track(SidewaysFrame(kBefore), nullptr).state, TrackingState::kSixDof);
}

TEST_F(MovedMap, ReferenceKeyFrameIsTheSourceOfMostInliers) {
  std::map<KeyFrameId, int> sources;
  for (const PointMatch& match : last_.matches) {
    if (match.inlier) ++sources[before_->FindPoint(match.point)->source_keyframe];
  }
  const KeyFrameId reference_keyframe = FindReferenceKeyFrame(*before_, last_.matches);
  for (const auto& [keyframe, count] : sources) EXPECT_LE(count, sources[reference_keyframe]) << keyframe;
  EXPECT_EQ(FindReferenceKeyFrame(*before_, {}), before_->keyframes.back().id)
      << "without matches, the newest keyframe";
  EXPECT_EQ(FindReferenceKeyFrame({}, {}), kNoId);
}

}  // namespace
}  // namespace docent::engine

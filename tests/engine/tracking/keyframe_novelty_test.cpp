// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/keyframe_novelty.h"

#include <gtest/gtest.h>

#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::CameraAt;

// Keyframes at these poses, each of which observes the same 200 points.
MapSnapshot MapOfPoses(const std::vector<Rigid3>& poses) {
  MapSnapshot map;
  for (const Rigid3& pose : poses) {
    KeyFrame keyframe;
    keyframe.id = map.next_keyframe++;
    keyframe.camera_from_map = pose;
    map.keyframes.push_back(keyframe);
    for (MapPointId point = 0; point < 200; ++point)
      map.observations.push_back({keyframe.id, point, Eigen::Vector2f(10, 10), 0});
  }
  map.next_point = 200;
  return map;
}

MapTrackResult Tracked(int inliers, double median_depth) {
  MapTrackResult tracked;
  tracked.inliers = tracked.found = tracked.finite_inliers = inliers;
  tracked.attempted = inliers + 20;
  tracked.median_depth = median_depth;
  tracked.converged = true;
  return tracked;
}

bool Wants(const MapSnapshot& map, const Rigid3& pose, int inliers = 190, double depth = 2) {
  return NeedsKeyFrame({}, map, pose, Tracked(inliers, depth));
}

TEST(KeyFrameNovelty, WantsNoKeyframeNearAnExistingOne) {
  const MapSnapshot map = MapOfPoses({CameraAt({0, 0, 0}), CameraAt({1, 0, 0})});
  EXPECT_FALSE(Wants(map, CameraAt({0, 0, 0})));
  EXPECT_FALSE(Wants(map, CameraAt({1.02, 0, 0.01}, {1, 0, 0})));
}

TEST(KeyFrameNovelty, MeasuresDistanceRelativeToTheDepth) {
  const MapSnapshot map = MapOfPoses({CameraAt({0, 0, 0})});
  const double threshold = KeyFrameNoveltyOptions().min_distance;
  for (const double depth : {0.5, 2.0, 10.0}) {
    EXPECT_FALSE(Wants(map, CameraAt({0.9 * threshold * depth, 0, 0}), 190, depth)) << depth;
    EXPECT_TRUE(Wants(map, CameraAt({1.1 * threshold * depth, 0, 0}), 190, depth)) << depth;
  }
}

TEST(KeyFrameNovelty, ComparesWithTheNearestKeyframeOnly) {
  const MapSnapshot map = MapOfPoses({CameraAt({0, 0, 0}), CameraAt({1, 0, 0}), CameraAt({2, 0, 0})});
  EXPECT_TRUE(Wants(map, CameraAt({0.5, 0, 0})));
  EXPECT_FALSE(Wants(map, CameraAt({1.05, 0, 0})));
}

TEST(KeyFrameNovelty, WantsAKeyframeAfterARotation) {
  const MapSnapshot map = MapOfPoses({CameraAt({0, 0, 0})});
  const double turn = KeyFrameNoveltyOptions().min_rotation_deg;
  EXPECT_FALSE(Wants(map, CameraAt({0, 0, 0}, {0, 0.8 * turn, 0})));
  EXPECT_TRUE(Wants(map, CameraAt({0, 0, 0}, {0, 1.2 * turn, 0})));
  // Half of each threshold together is not enough; four fifths of each is.
  EXPECT_FALSE(Wants(map, CameraAt({0.5 * 0.1 * 2, 0, 0}, {0, 0.5 * turn, 0})));
  EXPECT_TRUE(Wants(map, CameraAt({0.8 * 0.1 * 2, 0, 0}, {0, 0.8 * turn, 0})));
}

TEST(KeyFrameNovelty, LowersTheThresholdForFewInliersButRequiresParallax) {
  const MapSnapshot map = MapOfPoses({CameraAt({0, 0, 0})});
  const Rigid3 short_distance = CameraAt({0.06 * 2, 0, 0}), tiny_distance = CameraAt({0.02 * 2, 0, 0});
  EXPECT_FALSE(Wants(map, short_distance, 150));
  EXPECT_TRUE(Wants(map, short_distance, 90));
  EXPECT_FALSE(Wants(map, tiny_distance, 90));
}

TEST(KeyFrameNovelty, WantsTheFirstKeyframeOfAnEmptyMap) {
  EXPECT_TRUE(Wants(MapOfPoses({}), CameraAt({0, 0, 0})));
}

}  // namespace
}  // namespace docent::engine

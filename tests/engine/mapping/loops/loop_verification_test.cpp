// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loops/loop_verification.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "engine/vision/features.h"
#include "tests/engine/geometry/test_math.h"
#include "tests/engine/mapping/loops/there_and_back.h"

namespace docent::engine {
namespace {

using testing_world::CameraAt;
using testing_world::GalleryCamera;
using testing_world::SmallDrift;
using testing_world::ThereAndBack;
using testing_world::TruePoseThereAndBack;

constexpr KeyFrameId kBackAgain = 15;  // 0.3 m along the gallery, on the way back
// Keyframes of the way out around it, the one that is most similar first.
constexpr std::array<KeyFrameId, 3> kKnownPlace = {1, 0, 2};

// The pose of the keyframe in the coordinates of the place, with the error that RANSAC leaves.
Rigid3 RoughPose(KeyFrameId keyframe = kBackAgain) {
  return CameraAt({0.02, -0.01, 0.02}, {0.4, -0.5, 0.3}) * TruePoseThereAndBack(keyframe);
}

std::optional<LoopCandidate> Verify(const LoopVerificationOptions& options, Map* map) {
  PointSearcher searcher;
  return VerifyLoopCandidate(options, kBackAgain, kKnownPlace, RoughPose(), map, &searcher);
}

TEST(LoopVerification, EstimatesTheRelativePoseAndTheScaleOfTheDrift) {
  for (const double scale : {1.0, 0.7, 1.25}) {
    Sim3 drift = SmallDrift();
    drift.scale = scale;
    Map map = ThereAndBack(drift);
    const auto candidate = Verify({}, &map);
    ASSERT_TRUE(candidate) << scale;
    EXPECT_EQ(candidate->keyframe, kBackAgain);
    EXPECT_EQ(candidate->place, kKnownPlace[0]);
    // The frame of the keyframe has the scale of the way back, that of the place the scale of the way out.
    const Rigid3 truth = TruePoseThereAndBack(kBackAgain) * TruePoseThereAndBack(kKnownPlace[0]).inverse();
    const Sim3& estimate = candidate->keyframe_from_place;
    EXPECT_NEAR(std::log(estimate.scale), std::log(scale), 0.01);
    EXPECT_LT(Degrees(AngleBetween(estimate.rotation, truth.rotation)), 0.2);
    EXPECT_LT((estimate.translation - scale * truth.translation).norm(), 0.01 * scale);
  }
}

TEST(LoopVerification, FindsThePointsOfThePlaceAndTheirDuplicates) {
  Map map = ThereAndBack(SmallDrift());
  const auto candidate = Verify({}, &map);
  ASSERT_TRUE(candidate);
  const LoopVerificationOptions options;
  ASSERT_GE(candidate->seen.size(), static_cast<std::size_t>(options.min_inliers));
  EXPECT_LE(candidate->seen.size(), static_cast<std::size_t>(candidate->expected));
  EXPECT_GE(candidate->reverse_inliers, options.min_reverse_inliers);
  const Rigid3 truth = TruePoseThereAndBack(kBackAgain);
  std::size_t misplaced = 0;
  for (const Observation& seen : candidate->seen) {
    EXPECT_EQ(seen.keyframe, kBackAgain);
    const Map::PointRecord* point = map.FindPoint(seen.point);
    ASSERT_NE(point, nullptr);
    EXPECT_LT(point->observers.front(), 9u) << "not a point of the way out";
    const Eigen::Vector2d pixel = *GalleryCamera()->Project(truth * point->point.position());
    misplaced += (pixel - seen.pixel.cast<double>()).norm() > 2.0 * (1 << seen.level);
  }
  EXPECT_LE(misplaced, candidate->seen.size() / 20);
  ASSERT_GE(candidate->duplicates.size(), static_cast<std::size_t>(options.min_duplicates));
  std::size_t apart = 0;
  for (const DuplicatePoints& pair : candidate->duplicates) {
    const Eigen::Vector3d known = map.FindPoint(pair.known)->point.position();
    const Eigen::Vector3d recent = SmallDrift().inverse() * map.FindPoint(pair.recent)->point.position();
    apart += (known - recent).norm() > 0.04;
  }
  EXPECT_LE(apart, candidate->duplicates.size() / 20);
}

TEST(LoopVerification, DoesNotChangeTheMap) {
  Map map = ThereAndBack(SmallDrift());
  const auto before = map.Snapshot();
  ASSERT_TRUE(Verify({}, &map));
  const auto after = map.Snapshot();
  EXPECT_EQ(after->observations.size(), before->observations.size());
  ASSERT_EQ(after->points.size(), before->points.size());
  for (std::size_t i = 0; i < before->points.size(); ++i)
    EXPECT_EQ(after->points[i].point_in_map, before->points[i].point_in_map);
  ASSERT_EQ(after->keyframes.size(), before->keyframes.size());
  for (std::size_t i = 0; i < before->keyframes.size(); ++i)
    EXPECT_EQ(after->keyframes[i].camera_from_map.translation,
              before->keyframes[i].camera_from_map.translation);
}

TEST(LoopVerification, RefusesAnotherPlace) {
  Map map = ThereAndBack(SmallDrift());
  PointSearcher searcher;
  // As if the keyframe stood where keyframe 7 stands, in front of another panel.
  const std::array<KeyFrameId, 3> elsewhere = {7, 6, 8};
  EXPECT_FALSE(VerifyLoopCandidate({}, kBackAgain, elsewhere, TruePoseThereAndBack(7), &map, &searcher));
  // In front of its own panel, but far from the true pose.
  const Rigid3 aside = CameraAt({0.5, 0, 0}, {0, 15, 0}) * TruePoseThereAndBack(kBackAgain);
  EXPECT_FALSE(VerifyLoopCandidate({}, kBackAgain, kKnownPlace, aside, &map, &searcher));
}

TEST(LoopVerification, RefusesKeyframesThatDoNotExistAndEmptyPlaces) {
  Map map = ThereAndBack(SmallDrift());
  PointSearcher searcher;
  EXPECT_FALSE(VerifyLoopCandidate({}, 999, kKnownPlace, RoughPose(), &map, &searcher));
  EXPECT_FALSE(VerifyLoopCandidate({}, kBackAgain, {}, RoughPose(), &map, &searcher));
}

// On surfaces that do not correspond, the depth ratios of known and recent points have no common scale.
TEST(LoopVerification, RefusesPointsWhoseDepthsDoNotAgreeOnAScale) {
  Map map = ThereAndBack(SmallDrift());
  const Eigen::Vector3d center = map.FindKeyFrame(kBackAgain)->keyframe.camera_from_map.OriginInSource();
  std::size_t count = 0;
  for (const Observation& observation : map.FindKeyFrame(kBackAgain)->observations) {
    Eigen::Vector4d& point = map.FindPoint(observation.point)->point.point_in_map;
    const double factor = std::array{0.7, 1.0, 1.4}[++count % 3];
    point.head<3>() = center + factor * (point.head<3>() - center);
  }
  // The reverse check would refuse them too.
  LoopVerificationOptions options;
  options.min_reverse_inliers = 0;
  options.min_reverse_ratio = 0;
  EXPECT_FALSE(Verify(options, &map));
  options.max_scale_spread = 10;
  EXPECT_TRUE(Verify(options, &map));
}

TEST(LoopVerification, RefusesAPlaceThatDoesNotShowTheKeyframesPoints) {
  Map map = ThereAndBack(SmallDrift());
  // The points of the place were seen by other keyframes, too; this one shows something else.
  KeyFrame& place = map.FindKeyFrame(kKnownPlace[0])->keyframe;
  place.features = MakeFeatures(
      testing_world::Gallery({21, 22}, {31, 32}).Render(*GalleryCamera(), place.camera_from_map));
  EXPECT_FALSE(Verify({}, &map));
  LoopVerificationOptions options;
  options.min_reverse_inliers = 0;
  options.min_reverse_ratio = 0;
  EXPECT_TRUE(Verify(options, &map));
}

TEST(LoopVerification, RefusesPointsInOneCornerOfTheImage) {
  Map map = ThereAndBack(SmallDrift());
  const Rigid3 truth = TruePoseThereAndBack(kBackAgain);
  std::vector<MapPointId> outside;
  for (const Map::PointRecord& record : map.points()) {
    if (record.observers.front() >= 9) continue;  // of the way back
    const auto pixel = GalleryCamera()->Project(truth * record.point.position());
    if (!pixel || pixel->x() > 180 || pixel->y() > 140) outside.push_back(record.point.id);
  }
  for (const MapPointId id : outside) map.RemovePoint(id);
  LoopVerificationOptions options;
  options.min_first_matches = 10;
  options.min_inliers = 10;
  options.min_duplicates = 5;
  options.max_position_sigma = 1;
  EXPECT_FALSE(Verify(options, &map));
  options.min_cells = 1;
  EXPECT_TRUE(Verify(options, &map));
}

}  // namespace
}  // namespace docent::engine

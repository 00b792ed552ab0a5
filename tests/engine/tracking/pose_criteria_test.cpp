// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/pose_criteria.h"

#include <gtest/gtest.h>

namespace docent::engine {
namespace {

// A pose that nothing speaks against: 200 of 300 points agree, all over the image.
MapTrackResult SoundPose() {
  MapTrackResult result;
  result.attempted = 300;
  result.found = 220;
  result.inliers = result.finite_inliers = 200;
  result.sigma = 0.8;
  result.occupied_cells = 14;
  result.converged = true;
  return result;
}

MapSnapshot MapWithDepth() {
  MapSnapshot map;
  MapPoint point;
  point.point_in_map << 0, 0, 1, 1;
  map.points.push_back(point);
  return map;
}

TrackerOptions ReadOnly() {
  TrackerOptions options;
  options.build_maps = false;
  return options;
}

constexpr auto kStandard = PatchComparison::kStandard;
constexpr auto kTolerant = PatchComparison::kTolerant;

TEST(PoseCriteria, AcceptASoundPose) {
  const PoseCriteria criteria{TrackerOptions()};
  EXPECT_TRUE(criteria.IsAccepted(SoundPose(), kStandard));
  EXPECT_TRUE(criteria.IsGood(SoundPose()));
  EXPECT_EQ(criteria.RejectionReasonOf(SoundPose(), MapWithDepth(), kStandard), RejectionReason::kNone);
}

TEST(PoseCriteria, RejectAPoseWithFewScatteredOrPoorInliers) {
  const PoseCriteria criteria{TrackerOptions()};
  MapTrackResult pose = SoundPose();
  pose.inliers = 29;
  EXPECT_FALSE(criteria.IsAccepted(pose, kStandard)) << "few inliers";
  pose = SoundPose();
  pose.occupied_cells = 2;
  EXPECT_FALSE(criteria.IsAccepted(pose, kStandard)) << "one corner of the image";
  pose = SoundPose();
  pose.sigma = 5;
  EXPECT_FALSE(criteria.IsAccepted(pose, kStandard)) << "large residuals";
  pose = SoundPose();
  pose.converged = false;
  EXPECT_FALSE(criteria.IsAccepted(pose, kStandard)) << "not converged";
}

TEST(PoseCriteria, AcceptALowInlierRatioWithConsensusOnly) {
  const PoseCriteria criteria{TrackerOptions()};
  MapTrackResult pose = SoundPose();
  pose.attempted = 1000;
  pose.inliers = 100;
  pose.found = 120;
  EXPECT_TRUE(criteria.IsAccepted(pose, kStandard));
  EXPECT_TRUE(criteria.IsGood(pose));
  pose.found = 400;
  EXPECT_FALSE(criteria.IsAccepted(pose, kStandard));
  EXPECT_FALSE(criteria.IsGood(pose));
}

TEST(PoseCriteria, AreStricterWithPhotometricToleranceAndWithoutMapping) {
  MapTrackResult pose = SoundPose();
  pose.inliers = 75;  // a ratio of 0.25, below good quality
  pose.found = 200;
  pose.sigma = 1.6;
  EXPECT_TRUE(PoseCriteria{TrackerOptions()}.IsAccepted(pose, kStandard));
  EXPECT_FALSE(PoseCriteria{TrackerOptions()}.IsAccepted(pose, kTolerant));
  EXPECT_FALSE(PoseCriteria{ReadOnly()}.IsAccepted(pose, kStandard));
}

TEST(PoseCriteria, AcceptALargeResidualWithoutMappingIfTheInliersAreAConsensus) {
  const PoseCriteria criteria{ReadOnly()};
  MapTrackResult pose = SoundPose();
  pose.inliers = 63;
  pose.found = 64;
  pose.attempted = 225;  // a ratio of 0.28, below good quality
  pose.sigma = 1.8;
  EXPECT_TRUE(criteria.IsAccepted(pose, kTolerant));
  pose.found = 200;
  EXPECT_FALSE(criteria.IsAccepted(pose, kTolerant)) << "most of the points found contradict the pose";
  pose.found = 64;
  pose.attempted = 350;
  EXPECT_FALSE(criteria.IsAccepted(pose, kTolerant)) << "a small inlier ratio";
}

TEST(PoseCriteria, HoldTheTrackByFewTightInliersWithoutMappingOnly) {
  MapTrackResult pose = SoundPose();
  pose.attempted = 60;
  pose.inliers = 20;
  pose.sigma = 0.7;
  EXPECT_TRUE(PoseCriteria{ReadOnly()}.KeepsTrackWithFewPoints(pose));
  EXPECT_FALSE(PoseCriteria{TrackerOptions()}.KeepsTrackWithFewPoints(pose));
  pose.sigma = 1.2;
  EXPECT_FALSE(PoseCriteria{ReadOnly()}.KeepsTrackWithFewPoints(pose));
}

TEST(PoseCriteria, SayWhyAPoseAfterALossIsRejected) {
  const PoseCriteria criteria{TrackerOptions()};
  const MapSnapshot map = MapWithDepth();
  MapTrackResult pose = SoundPose();
  pose.inliers = 39;
  EXPECT_EQ(criteria.RejectionReasonOf(pose, map, kStandard), RejectionReason::kFewPoints);
  pose = SoundPose();
  pose.converged = false;
  EXPECT_EQ(criteria.RejectionReasonOf(pose, map, kStandard), RejectionReason::kPoorFit);
  pose = SoundPose();
  pose.occupied_cells = 4;
  EXPECT_EQ(criteria.RejectionReasonOf(pose, map, kStandard), RejectionReason::kClustered);
  pose = SoundPose();
  pose.contradicted_ratio = 0.6;
  EXPECT_EQ(criteria.RejectionReasonOf(pose, map, kStandard), RejectionReason::kContradicted);
  EXPECT_TRUE(criteria.IsAccepted(pose, kStandard)) << "a track goes on when the camera is partly hidden";
  pose.contradicted_ratio = 0.4;
  pose.contradicted_area = 0.5;
  EXPECT_EQ(criteria.RejectionReasonOf(pose, map, kStandard), RejectionReason::kContradicted);
  TrackerOptions tour;
  tour.build_maps = false;
  EXPECT_EQ(PoseCriteria(tour).RejectionReasonOf(pose, map, kStandard), RejectionReason::kNone)
      << "people may hide so much from a visitor";
  pose = SoundPose();
  pose.attempted = 1000;  // a ratio of 0.2
  EXPECT_EQ(criteria.RejectionReasonOf(pose, map, kStandard), RejectionReason::kFewPoints);
  EXPECT_EQ(criteria.RejectionReasonOf(pose, map, kTolerant), RejectionReason::kNone);
}

TEST(PoseCriteria, RefuseARotationWithLargeResidualsInAMapWithDepthOnly) {
  const PoseCriteria criteria{TrackerOptions()};
  MapTrackResult pose = SoundPose();
  pose.observed = ObservedMotion::kPanorama;
  pose.sigma = 1.5;
  EXPECT_FALSE(criteria.FitsRotation(pose, MapWithDepth()));
  EXPECT_TRUE(criteria.FitsRotation(pose, MapSnapshot()));
  pose.observed = ObservedMotion::kSixDof;
  EXPECT_TRUE(criteria.FitsRotation(pose, MapWithDepth()));
}

}  // namespace
}  // namespace docent::engine

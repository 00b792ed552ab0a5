// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/depth_significance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/base/median.h"
#include "engine/geometry/triangulation.h"
#include "tests/engine/initialization/two_view_scene.h"

namespace docent::engine {
namespace {

using testing_scene::MakeTwoViews;
using testing_scene::Motion;
using testing_scene::SceneOptions;
using testing_scene::TwoViews;
using testing_scene::Volume;

constexpr double kPixelAngle = 1 / testing_scene::kFocal;

Rigid3 WithUnitBaseline(Rigid3 b_from_a) {
  b_from_a.translation.normalize();
  return b_from_a;
}

DepthSignificance Measure(const TwoViews& views, const Rigid3& pose, double noise_px,
                          const DepthNoiseOptions& options = {},
                          StructureModel model = StructureModel::kGeneral) {
  const RayPairs pairs = MakeRayPairs(views.rays_in_a, views.rays_in_b, kPixelAngle);
  return MeasureDepthSignificance(pairs, std::vector<bool>(views.rays_in_a.size(), true), pose, model,
                                  noise_px, options);
}

TEST(DepthSignificance, PredictsTheScatterOfDepthsCausedByNoise) {
  DepthNoiseOptions noise_alone;
  noise_alone.calibration_share = 0;
  for (const double baseline : {0.08, 0.2}) {
    const Rigid3 truth = Motion({baseline, 0.01, 0.02}, {0.5, 2, 0.3});
    std::vector<double> predicted, seen;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      Random random(seed);
      const TwoViews views = MakeTwoViews(Volume(2, 5), truth, {.noise_px = 0.4}, &random);
      const RayPairs pairs = MakeRayPairs(views.rays_in_a, views.rays_in_b, kPixelAngle);
      const Rigid3 pose = RefinePose(pairs, Weights::Ones(pairs.size()), WithUnitBaseline(truth), 3, 30);
      predicted.push_back(Measure(views, pose, 0.4, noise_alone).relative_depth_sigma);
      for (std::size_t i = 0; i < views.points_in_a.size(); ++i) {
        const auto point = Triangulate(views.rays_in_a[i], views.rays_in_b[i], pose);
        if (!point) continue;
        const double inverse_depth = views.points_in_a[i].norm() / (point->norm() * truth.translation.norm());
        seen.push_back(std::abs(inverse_depth - 1));
      }
    }
    const double scatter = 1.4826 * Median(seen);  // for a normal distribution
    EXPECT_GT(Median(predicted), 0.6 * scatter) << "baseline " << baseline;
    EXPECT_LT(Median(predicted), 1.6 * scatter) << "baseline " << baseline;
  }
}

TEST(DepthSignificance, IsHigherForAPlaneThanForFreePointsOnIt) {
  DepthNoiseOptions noise_alone;
  noise_alone.calibration_share = 0;
  Random random(2);
  const Rigid3 truth = Motion({0.3, 0.05, 0.1}, {0.5, 2, 0.3});
  const TwoViews views =
      MakeTwoViews(testing_scene::OnPlane({0.2, 0.1, 1}, 3), truth, {.noise_px = 0.4}, &random);
  const double as_plane =
      Measure(views, WithUnitBaseline(truth), 0.4, noise_alone, StructureModel::kPlane).relative_depth_sigma;
  const double as_points = Measure(views, WithUnitBaseline(truth), 0.4, noise_alone).relative_depth_sigma;
  EXPECT_LT(as_plane, 0.02) << "eight parameters from 800 coordinates";
  EXPECT_GT(as_points, 2 * as_plane);
}

TEST(DepthSignificance, IsLargeIfTheCameraMovedAmongObjectsAtDifferentDepths) {
  Random random(3);
  const Rigid3 truth = Motion({0.3, 0, 0}, {0, 1, 0});
  const TwoViews views = MakeTwoViews(Volume(2, 5), truth, {.noise_px = 0.4}, &random);
  const DepthSignificance significance = Measure(views, WithUnitBaseline(truth), 0.4);
  EXPECT_GT(significance.Ratio(), 8);
  EXPECT_LT(significance.relative_depth_sigma, 0.1);
}

TEST(DepthSignificance, IsSmallForPureRotationWithAWrongFocalLength) {
  for (const double focal_error : {0.98, 0.99, 1.01, 1.02}) {
    Random random(4);
    const TwoViews views = MakeTwoViews(Volume(2, 5), Motion({0, 0, 0}, {3, 12, 4}),
                                        {.noise_px = 0.3, .focal_error = focal_error}, &random);
    const DepthSignificance significance = Measure(views, Motion({1, 0, 0}, {3, 12, 4}), 0.3);
    EXPECT_LT(significance.Ratio(), 2) << focal_error;
  }
}

TEST(DepthSignificance, IncludesTheSkewOfARollingShutter) {
  Random random(5);
  const Rigid3 truth = Motion({0.1, 0, 0}, {0, 1, 0});
  const TwoViews views = MakeTwoViews(Volume(2, 5), truth, {.noise_px = 0.3}, &random);
  DepthNoiseOptions fast;
  fast.speed_change_px = 40;
  const DepthSignificance still = Measure(views, WithUnitBaseline(truth), 0.3);
  const DepthSignificance moving = Measure(views, WithUnitBaseline(truth), 0.3, fast);
  EXPECT_GT(moving.expected_error_px, 2 * still.expected_error_px);
  EXPECT_GT(moving.relative_depth_sigma, 2 * still.relative_depth_sigma);
}

TEST(DepthSignificance, IsZeroForTooFewPairs) {
  Random random(6);
  const Rigid3 truth = Motion({0.3, 0, 0}, {0, 0, 0});
  const TwoViews views = MakeTwoViews(Volume(2, 5), truth, {.count = 6}, &random);
  EXPECT_EQ(Measure(views, WithUnitBaseline(truth), 0.5).Ratio(), 0);
}

}  // namespace
}  // namespace docent::engine

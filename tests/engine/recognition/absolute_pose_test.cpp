// SPDX-License-Identifier: Apache-2.0
#include "engine/recognition/absolute_pose.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/engine/initialization/two_view_scene.h"

namespace docent::engine {
namespace {

using testing_scene::kFocal;
using testing_scene::PixelOfPoint;
using testing_scene::RandomPixel;
using testing_scene::RayOfPixel;

struct AbsoluteView {
  std::vector<Eigen::Vector3d> rays, points;
  std::vector<bool> correct;
  Rigid3 camera_from_map;
};

Rigid3 RandomPose(Random* random) {
  return {Rotation3::Exp(random->Uniform(0, kPi) * RandomDirection(random)), 3 * RandomDirection(random)};
}

// in_camera(random) returns a random point in the camera frame.
template <class InCamera>
AbsoluteView MakeView(int count, double noise_px, double outlier_ratio, Random* random,
                      const InCamera& in_camera) {
  AbsoluteView view;
  view.camera_from_map = RandomPose(random);
  while (static_cast<int>(view.rays.size()) < count) {
    const Eigen::Vector3d x = in_camera(random);
    const auto pixel = PixelOfPoint(x);
    if (!pixel) continue;
    const bool correct = random->Uniform() >= outlier_ratio;
    const Eigen::Vector2d noise = noise_px * RandomNormals(random);
    view.rays.push_back(RayOfPixel(correct ? *pixel + noise : RandomPixel(random)));
    view.points.push_back(view.camera_from_map.inverse() * x);
    view.correct.push_back(correct);
  }
  return view;
}

Eigen::Vector3d InVolume(Random* random) {
  return random->Uniform(1, 4) * RayOfPixel(RandomPixel(random));
}
Eigen::Vector3d OnSlantedPlane(Random* random) {
  const Eigen::Vector3d ray = RayOfPixel(RandomPixel(random));
  return 1.2 / Eigen::Vector3d(0, 0.6, 0.8).dot(ray) * ray;
}

double CenterError(const Rigid3& a, const Rigid3& b) {
  return (a.OriginInSource() - b.OriginInSource()).norm();
}

TEST(ThreePoints, SolutionsIncludeTheTruePoseAndAllFitExactly) {
  int found = 0;
  constexpr int kTrials = 2000;
  for (int trial = 0; trial < kTrials; ++trial) {
    Random random(static_cast<std::uint64_t>(trial) + 1);
    const AbsoluteView view = MakeView(3, 0, 0, &random, InVolume);
    const std::array<Eigen::Vector3d, 3> rays = {view.rays[0], view.rays[1], view.rays[2]};
    const std::array<Eigen::Vector3d, 3> points = {view.points[0], view.points[1], view.points[2]};
    const auto poses = SolveThreePoints(rays, points);
    EXPECT_LE(poses.size(), 4u) << trial;
    bool is_there = false;
    for (const Rigid3& pose : poses) {
      is_there |= IsNear(pose, view.camera_from_map, 1e-4, 1e-4);
      for (std::size_t i = 0; i < 3; ++i)
        EXPECT_LT(((pose * points[i]).normalized() - rays[i]).norm(), 1e-5) << trial;
    }
    found += is_there;
  }
  // A nearly double root of the quartic loses precision; RANSAC then draws another sample.
  EXPECT_GE(found, kTrials * 995 / 1000);
}

TEST(ThreePoints, SolvesSymmetricViewsWithAZeroDenominator) {
  std::array<Eigen::Vector3d, 3> points, rays;
  const Rigid3 camera_from_map(Rotation3(), {0, 0, 2});
  for (std::size_t i = 0; i < 3; ++i) {
    const double angle = 2 * kPi * static_cast<double>(i) / 3;
    points[i] = {std::cos(angle), std::sin(angle), 0};
    rays[i] = (camera_from_map * points[i]).normalized();
  }
  bool is_there = false;
  for (const Rigid3& pose : SolveThreePoints(rays, points))
    is_there |= IsNear(pose, camera_from_map, 1e-5, 1e-5);
  EXPECT_TRUE(is_there);
}

TEST(ThreePoints, CollinearPointsHaveNoPose) {
  const std::array<Eigen::Vector3d, 3> points = {Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(0.5, 0, 2),
                                                 Eigen::Vector3d(1, 0, 2)};
  std::array<Eigen::Vector3d, 3> rays;
  for (std::size_t i = 0; i < 3; ++i) rays[i] = points[i].normalized();
  EXPECT_TRUE(SolveThreePoints(rays, points).empty());
  rays[1] = rays[0];
  const std::array<Eigen::Vector3d, 3> triangle = {Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(0.5, 0, 2),
                                                   Eigen::Vector3d(1, 1, 2)};
  EXPECT_TRUE(SolveThreePoints(rays, triangle).empty());
}

class AbsolutePoseWithOutliers : public testing::TestWithParam<double> {};

TEST_P(AbsolutePoseWithOutliers, IsFoundForPointsInVolumesAndOnPlanes) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for (const bool table : {false, true}) {
      Random random(seed);
      const AbsoluteView view = MakeView(120, 1.0, GetParam(), &random, table ? OnSlantedPlane : InVolume);
      const auto pose = EstimateAbsolutePose(view.rays, view.points, {.max_iterations = 1000, .seed = seed});
      ASSERT_TRUE(pose) << seed;
      // 30 correct rays with one pixel of noise on a plane: the worst of 20 seeds is 0.33 degrees.
      EXPECT_LT(RotationErrorDeg(pose->camera_from_map, view.camera_from_map), 0.4) << seed << table;
      EXPECT_LT(CenterError(pose->camera_from_map, view.camera_from_map), 0.02) << seed << table;
      int wrong = 0, missed = 0, correct = 0;
      for (std::size_t i = 0; i < view.correct.size(); ++i) {
        wrong += pose->inlier[i] && !view.correct[i];
        missed += !pose->inlier[i] && view.correct[i];
        correct += view.correct[i];
      }
      EXPECT_LE(wrong, 2) << seed;
      EXPECT_LE(missed, 5) << seed;
      EXPECT_EQ(pose->inlier_count, correct - missed + wrong);
      EXPECT_GT(pose->rms_px, 0.8);
      EXPECT_LT(pose->rms_px, 1.8);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(AbsolutePose, AbsolutePoseWithOutliers, testing::Values(0.0, 0.3, 0.6, 0.75));

TEST(AbsolutePose, WithoutNoiseIsExact) {
  Random random(5);
  const AbsoluteView view = MakeView(20, 0, 0, &random, InVolume);
  const auto pose = EstimateAbsolutePose(view.rays, view.points, {});
  ASSERT_TRUE(pose);
  EXPECT_TRUE(IsNear(pose->camera_from_map, view.camera_from_map, 1e-9, 1e-9));
  EXPECT_EQ(pose->inlier_count, 20);
}

TEST(AbsolutePose, PointsBehindTheCameraAreNotInliers) {
  Random random(6);
  AbsoluteView view = MakeView(40, 0.3, 0, &random, InVolume);
  for (std::size_t i = 0; i < 10; ++i)
    view.points[i] =
        view.camera_from_map.inverse() * Eigen::Vector3d(-(view.camera_from_map * view.points[i]));
  const auto pose = EstimateAbsolutePose(view.rays, view.points, {});
  ASSERT_TRUE(pose);
  EXPECT_EQ(pose->inlier_count, 30);
  for (std::size_t i = 0; i < 10; ++i) EXPECT_FALSE(pose->inlier[i]);
  EXPECT_LT(CenterError(pose->camera_from_map, view.camera_from_map), 0.01);
}

TEST(AbsolutePose, IsRejectedForWrongMatchesOnly) {
  int accepted = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    Random random(seed);
    const AbsoluteView view = MakeView(100, 1.0, 1.0, &random, InVolume);
    accepted += EstimateAbsolutePose(view.rays, view.points, {.min_inliers = 10, .seed = seed}).has_value();
  }
  EXPECT_EQ(accepted, 0);
}

TEST(AbsolutePose, RequiresAnInlierCountAndAnInlierRatio) {
  Random random(8);
  const AbsoluteView view = MakeView(50, 0.5, 0.5, &random, InVolume);
  EXPECT_TRUE(EstimateAbsolutePose(view.rays, view.points, {.min_inliers = 15}));
  EXPECT_FALSE(EstimateAbsolutePose(view.rays, view.points, {.min_inliers = 40}));
  EXPECT_FALSE(EstimateAbsolutePose(view.rays, view.points, {.min_inlier_ratio = 0.8}));
  EXPECT_FALSE(EstimateAbsolutePose({}, {}, {}));
  const std::vector<Eigen::Vector3d> three_rays(view.rays.begin(), view.rays.begin() + 3);
  const std::vector<Eigen::Vector3d> three_points(view.points.begin(), view.points.begin() + 3);
  EXPECT_FALSE(EstimateAbsolutePose(three_rays, three_points, {.min_inliers = 3}));
}

TEST(AbsolutePose, IgnoresNonFiniteInput) {
  Random random(9);
  AbsoluteView view = MakeView(40, 0.3, 0, &random, InVolume);
  view.rays[0].setZero();
  view.rays[1].setConstant(std::numeric_limits<double>::quiet_NaN());
  view.points[2].x() = std::numeric_limits<double>::infinity();
  const auto pose = EstimateAbsolutePose(view.rays, view.points, {});
  ASSERT_TRUE(pose);
  EXPECT_EQ(pose->inlier.size(), 40u);
  EXPECT_EQ(pose->inlier_count, 37);
  EXPECT_LT(CenterError(pose->camera_from_map, view.camera_from_map), 0.01);
}

TEST(AbsolutePose, IsDeterministicForAGivenSeed) {
  Random random(10);
  const AbsoluteView view = MakeView(100, 1.0, 0.5, &random, InVolume);
  const auto first = EstimateAbsolutePose(view.rays, view.points, {.seed = 4});
  const auto second = EstimateAbsolutePose(view.rays, view.points, {.seed = 4});
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->camera_from_map.translation, second->camera_from_map.translation);
  EXPECT_EQ(first->camera_from_map.rotation.quaternion().coeffs(),
            second->camera_from_map.rotation.quaternion().coeffs());
  EXPECT_EQ(first->inlier, second->inlier);
}

TEST(RefineAbsolutePose, ConvergesFromAPerturbedPoseDespiteAFewOutliers) {
  Random random(11);
  AbsoluteView view = MakeView(60, 0.5, 0.05, &random, InVolume);
  const Rigid3 start =
      Rigid3::Exp((Eigen::Matrix<double, 6, 1>() << 0.05, -0.04, 0.06, 0.03, 0.02, -0.03).finished()) *
      view.camera_from_map;
  const Rigid3 refined = RefineAbsolutePose(view.rays, view.points, {}, start, 1 / kFocal, 1.0, 30);
  EXPECT_LT(RotationErrorDeg(refined, view.camera_from_map), 0.1);
  EXPECT_LT(CenterError(refined, view.camera_from_map), 0.01);
}

}  // namespace
}  // namespace docent::engine

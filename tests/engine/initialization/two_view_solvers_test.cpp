// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <vector>

#include "engine/initialization/five_point.h"
#include "engine/initialization/homography.h"
#include "engine/initialization/two_view_models.h"
#include "tests/engine/initialization/two_view_scene.h"

namespace docent::engine {
namespace {

using testing_scene::kFocal;
using testing_scene::MakeTwoViews;
using testing_scene::Motion;
using testing_scene::OnPlane;
using testing_scene::SceneOptions;
using testing_scene::TwoViews;
using testing_scene::Volume;

Rigid3 RandomMotion(Random* random) {
  return Motion(0.4 * RandomDirection(random), random->Uniform(0, 15) * RandomDirection(random));
}

template <std::size_t count>
std::array<Eigen::Vector3d, count> First(const std::vector<Eigen::Vector3d>& rays) {
  std::array<Eigen::Vector3d, count> result;
  std::copy_n(rays.begin(), count, result.begin());
  return result;
}

double EssentialDifference(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  const Eigen::Matrix3d unit_a = a / a.norm(), unit_b = b / b.norm();
  return std::min((unit_a - unit_b).norm(), (unit_a + unit_b).norm());
}

TEST(FivePoint, FindsTheEssentialMatrixAmongItsSolutions) {
  int found = 0;
  constexpr int kTrials = 500;
  for (int trial = 0; trial < kTrials; ++trial) {
    Random random(static_cast<std::uint64_t>(trial) + 1);
    const Rigid3 b_from_a = RandomMotion(&random);
    const TwoViews views = MakeTwoViews(Volume(1, 6), b_from_a, {.count = 5, .noise_px = 0}, &random);
    const auto a = First<5>(views.rays_in_a), b = First<5>(views.rays_in_b);
    const auto solutions = SolveFivePoint(a, b);
    EXPECT_LE(solutions.size(), 10u);
    double nearest = 2;
    for (const Eigen::Matrix3d& essential : solutions) {
      EXPECT_NEAR(essential.norm(), 1, 1e-9);
      for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(b[i].dot(essential * a[i]), 0, 1e-9);
      nearest = std::min(nearest, EssentialDifference(essential, EssentialFromPose(b_from_a)));
    }
    found += nearest < 1e-5;
  }
  // Occasionally five random points are near a degenerate configuration, or two roots merge.
  EXPECT_GE(found, kTrials * 98 / 100);
}

TEST(FivePoint, SolutionsAreEssentialMatrices) {
  Random random(77);
  const TwoViews views =
      MakeTwoViews(Volume(1, 6), RandomMotion(&random), {.count = 5, .noise_px = 1}, &random);
  const auto solutions = SolveFivePoint(First<5>(views.rays_in_a), First<5>(views.rays_in_b));
  ASSERT_FALSE(solutions.empty());
  for (const Eigen::Matrix3d& essential : solutions) {
    const Eigen::Vector3d singular = essential.jacobiSvd().singularValues();
    EXPECT_NEAR(singular[0], singular[1], 1e-6);
    EXPECT_NEAR(singular[2], 0, 1e-6);
  }
}

TEST(FivePoint, SurvivesFiveEqualPairs) {
  std::array<Eigen::Vector3d, 5> rays;
  rays.fill(Eigen::Vector3d::UnitZ());
  for (const Eigen::Matrix3d& essential : SolveFivePoint(rays, rays)) EXPECT_TRUE(essential.allFinite());
}

TEST(Essential, OneOfItsFourPosesIsTheMotion) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    Random random(seed);
    Rigid3 b_from_a = RandomMotion(&random);
    b_from_a.translation.normalize();
    int found = 0;
    for (const Rigid3& pose : PosesFromEssential(-3.0 * EssentialFromPose(b_from_a)))
      found += IsNear(pose, b_from_a, 1e-9, 1e-9);
    EXPECT_EQ(found, 1) << seed;
  }
}

Eigen::Matrix3d TrueHomography(const Rigid3& b_from_a, const Eigen::Vector3d& normal, double distance) {
  return b_from_a.rotation.matrix() + b_from_a.translation * normal.normalized().transpose() / distance;
}

TEST(Homography, FromFourPairsIsTheTrueOne) {
  int found = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    Random random(seed);
    const Rigid3 b_from_a = Motion(0.2 * RandomDirection(&random), 10 * RandomDirection(&random));
    const Eigen::Vector3d normal(random.Uniform(-0.5, 0.5), random.Uniform(-0.5, 0.5), 1);
    const TwoViews views =
        MakeTwoViews(OnPlane(normal, 1.3), b_from_a, {.count = 30, .noise_px = 0}, &random);
    const auto truth = ScaleHomography(TrueHomography(b_from_a, normal, 1.3));
    ASSERT_TRUE(truth);
    if (const auto four = SolveFourPoint(First<4>(views.rays_in_a), First<4>(views.rays_in_b))) {
      const auto scaled = ScaleHomography(*four);
      ASSERT_TRUE(scaled);
      EXPECT_LT((*scaled - *truth).norm(), 1e-4) << seed;
      ++found;
    }
  }
  EXPECT_GT(found, 45);  // three of the rays are coplanar now and then
}

TEST(Homography, OneOfItsDecompositionsIsTheTrueMotion) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Random random(seed);
    const Rigid3 b_from_a = Motion(0.3 * RandomDirection(&random), 20 * RandomDirection(&random));
    const Eigen::Vector3d normal =
        Eigen::Vector3d(random.Uniform(-0.7, 0.7), random.Uniform(-0.7, 0.7), 1).normalized();
    const auto homography = ScaleHomography(TrueHomography(b_from_a, normal, 2));
    ASSERT_TRUE(homography);
    const auto motions = DecomposeHomography(*homography);
    EXPECT_EQ(motions.size(), 4u);
    int found = 0;
    for (const PlaneMotion& motion : motions) {
      // Every decomposition must give the same homography.
      EXPECT_LT((TrueHomography(motion.b_from_a, motion.normal_in_a, 1) - *homography).norm(), 1e-6);
      found += IsNear(motion.b_from_a, {b_from_a.rotation, b_from_a.translation / 2}, 1e-6, 1e-6) &&
               (motion.normal_in_a - normal).norm() < 1e-5;
    }
    EXPECT_GE(found, 1) << seed;
  }
}

TEST(Homography, OfARotationHasNoPlane) {
  EXPECT_TRUE(DecomposeHomography(Rotation3::Exp({0.1, 0.2, -0.1}).matrix()).empty());
}

TEST(Homography, PairsOnALineDoNotDetermineIt) {
  std::vector<Eigen::Vector3d> rays;
  for (int i = 0; i < 4; ++i) rays.push_back(Eigen::Vector3d(0.1 * i, 0, 1).normalized());
  EXPECT_FALSE(SolveFourPoint(First<4>(rays), First<4>(rays)));
}

// The three kinds of residuals are comparable: for the true model, sigma^2 for an essential matrix and 2
// sigma^2 for the others.
TEST(TwoViewModels, ResidualsOfTheTrueModelEqualTheNoise) {
  constexpr double kNoise = 0.7;
  Random random(5);
  // A narrow view of the centre, where a pixel subtends pixel_angle.
  const auto middle = [](const TwoViews& views) {
    std::vector<Eigen::Vector3d> a, b;
    for (std::size_t i = 0; i < views.rays_in_a.size(); ++i) {
      if (std::min(views.rays_in_a[i].z(), views.rays_in_b[i].z()) < std::cos(Radians(12))) continue;
      a.push_back(views.rays_in_a[i]);
      b.push_back(views.rays_in_b[i]);
    }
    return MakeRayPairs(a, b, 1 / kFocal);
  };
  const SceneOptions options{.count = 20000, .noise_px = kNoise};
  const Rigid3 motion = Motion({0.2, 0.05, 0}, {0.5, 1, 3});
  const Eigen::Vector3d normal(0.1, -0.1, 1);
  const RayPairs room = middle(MakeTwoViews(Volume(2, 6), motion, options, &random));
  const RayPairs plane = middle(MakeTwoViews(OnPlane(normal, 2), motion, options, &random));
  const Rigid3 rotation = Motion({0, 0, 0}, {1, -2, 5});
  const RayPairs rotated = middle(MakeTwoViews(Volume(2, 6), rotation, options, &random));
  ASSERT_GT(room.size(), 1000);
  EXPECT_NEAR(EssentialResiduals(room, EssentialFromPose(motion)).mean(), kNoise * kNoise,
              0.06 * kNoise * kNoise);
  EXPECT_NEAR(HomographyResiduals(plane, TrueHomography(motion, normal, 2)).mean(), 2 * kNoise * kNoise,
              0.15 * kNoise * kNoise);
  EXPECT_NEAR(RotationResiduals(rotated, rotation.rotation.matrix()).mean(), 2 * kNoise * kNoise,
              0.12 * kNoise * kNoise);
}

TEST(TwoViewModels, RefinementsReturnToTheTruthFromADisturbedStart) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    Rigid3 motion = Motion({0.3, 0.1, 0.05}, {1, 4, -2});
    const TwoViews views = MakeTwoViews(Volume(2, 6), motion, {.count = 300, .noise_px = 0}, &random);
    const RayPairs pairs = MakeRayPairs(views.rays_in_a, views.rays_in_b, 1 / kFocal);
    motion.translation.normalize();
    const Rigid3 start(Rotation3::Exp(0.01 * RandomDirection(&random)) * motion.rotation,
                       (motion.translation + 0.1 * RandomDirection(&random)).normalized());
    const Rigid3 refined = RefinePose(pairs, Weights::Ones(pairs.size()), start, 1.0, 50);
    EXPECT_TRUE(IsNear(refined, motion, 1e-5, 1e-5)) << seed << refined << motion;

    const TwoViews flat =
        MakeTwoViews(OnPlane({0.2, 0.1, 1}, 2), motion, {.count = 300, .noise_px = 0}, &random);
    const RayPairs flat_pairs = MakeRayPairs(flat.rays_in_a, flat.rays_in_b, 1 / kFocal);
    const Eigen::Matrix3d truth = TrueHomography(motion, {0.2, 0.1, 1}, 2);
    const Eigen::Matrix3d disturbed = truth + 0.01 * Eigen::Matrix3d::Constant(random.Uniform(-1, 1)) +
                                      0.01 * RandomDirection(&random) * RandomDirection(&random).transpose();
    const Eigen::Matrix3d found =
        RefineHomography(flat_pairs, Weights::Ones(flat_pairs.size()), disturbed, 1.0, 50);
    EXPECT_LT((found / found.norm() - truth / truth.norm()).norm(), 1e-5) << seed;
  }
}

TEST(TwoViewModels, RotationFitIgnoresPairsWithoutWeight) {
  Random random(9);
  const Rigid3 rotation = Motion({0, 0, 0}, {4, -7, 12});
  const TwoViews views =
      MakeTwoViews(Volume(2, 6), rotation, {.count = 100, .noise_px = 0, .outlier_ratio = 0.3}, &random);
  const RayPairs pairs = MakeRayPairs(views.rays_in_a, views.rays_in_b, 1 / kFocal);
  Weights weights(pairs.size());
  for (Eigen::Index i = 0; i < pairs.size(); ++i) weights[i] = views.correct[static_cast<std::size_t>(i)];
  EXPECT_LT((FitRotation(pairs, weights) - rotation.rotation.matrix()).norm(), 1e-9);
}

}  // namespace
}  // namespace docent::engine

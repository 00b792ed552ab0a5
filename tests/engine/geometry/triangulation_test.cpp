// SPDX-License-Identifier: Apache-2.0
#include "engine/geometry/triangulation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/engine/geometry/transform_laws.h"

namespace docent::engine {
namespace {

double SquaredAngles(const Eigen::Vector3d& point_in_a, const Eigen::Vector3d& ray_a,
                     const Eigen::Vector3d& ray_b, const Rigid3& b_from_a) {
  const double in_a = AngleBetween(ray_a, point_in_a), in_b = AngleBetween(ray_b, b_from_a * point_in_a);
  return in_a * in_a + in_b * in_b;
}

TEST(TriangulateTest, FindsExactPointsAtAllDepths) {
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const Rigid3 b_from_a(Rotation3::Exp(RandomVector(&random, 1)), RandomVector(&random, 1));
    const Eigen::Vector3d point = std::exp(random.Uniform(-1, 5)) * RandomDirection(&random);
    const auto found = Triangulate(point.normalized(), (b_from_a * point).normalized(), b_from_a);
    ASSERT_TRUE(found);
    // The depth's rounding error grows with the inverse of the angle between the rays.
    EXPECT_LT((*found - point).norm(), 1e-11 * point.norm() * (1 + point.norm()));
  }
}

TEST(TriangulateTest, IsALocalMinimumOfTheAngularErrors) {
  Random random(2);
  constexpr double kNoise = 1e-4;  // radians; the result is optimal to first order in the noise
  for (int i = 0; i < 200; ++i) {
    const Rigid3 b_from_a(Rotation3::Exp(RandomVector(&random, 0.2)), Eigen::Vector3d(1, 0, 0.5));
    const Eigen::Vector3d point(random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(1, 6));
    const Eigen::Vector3d ray_a = (point.normalized() + RandomVector(&random, kNoise)).normalized();
    const Eigen::Vector3d ray_b =
        ((b_from_a * point).normalized() + RandomVector(&random, kNoise)).normalized();
    const auto found = Triangulate(ray_a, ray_b, b_from_a);
    ASSERT_TRUE(found);
    const double angles = SquaredAngles(*found, ray_a, ray_b, b_from_a);
    for (int k = 0; k < 30; ++k) {
      const Eigen::Vector3d neighbour = *found + 1e-4 * RandomDirection(&random);
      EXPECT_GT(SquaredAngles(neighbour, ray_a, ray_b, b_from_a), angles);
    }
  }
}

TEST(TriangulateTest, RejectsRaysThatMeetBehindACamera) {
  const Rigid3 b_from_a(Rotation3(), {-1, 0, 0});  // camera b is one metre to the right of camera a
  const Eigen::Vector3d right = Eigen::Vector3d(0.2, 0, 1).normalized(),
                        left = Eigen::Vector3d(-0.2, 0, 1).normalized();
  EXPECT_TRUE(Triangulate(right, left, b_from_a));
  EXPECT_FALSE(Triangulate(left, right, b_from_a));
  EXPECT_FALSE(Triangulate(right, -left, b_from_a));
  EXPECT_FALSE(Triangulate(-right, left, b_from_a));
}

TEST(TriangulateTest, RejectsParallelRaysAndAZeroBaseline) {
  const Rigid3 b_from_a(Rotation3(), {-1, 0, 0});
  const Eigen::Vector3d ahead(0, 0, 1);
  EXPECT_FALSE(Triangulate(ahead, ahead, b_from_a));
  EXPECT_FALSE(Triangulate(ahead, Eigen::Vector3d(1e-12, 0, 1).normalized(), b_from_a));
  EXPECT_FALSE(Triangulate(Eigen::Vector3d(0.1, 0, 1).normalized(), Eigen::Vector3d(-0.1, 0, 1).normalized(),
                           Rigid3()));
}

TEST(ParallaxAngleTest, IsTheAngleBetweenTheTwoRays) {
  EXPECT_NEAR(ParallaxAngle({0, 0, 0}, {1, 0, 0}, {0, 0, 1}), kPi / 4, 1e-15);
  EXPECT_NEAR(ParallaxAngle({-1, 0, 0}, {1, 0, 0}, {0, 0, 1}), kPi / 2, 1e-15);
  EXPECT_NEAR(ParallaxAngle({-1, 0, 0}, {1, 0, 0}, {0, 0, 1e9}), 2e-9, 1e-17);
  EXPECT_EQ(ParallaxAngle({1, 2, 3}, {1, 2, 3}, {4, 5, 6}), 0);
}

struct PlanarScene {
  Plane truth;
  std::vector<Eigen::Vector3d> points;
};

PlanarScene MakePlane(Random* random, int inliers, int outliers, double noise) {
  PlanarScene scene;
  scene.truth.normal = RandomDirection(random);
  scene.truth.offset = random->Uniform(-2, 2);
  const Eigen::Vector3d u = scene.truth.normal.unitOrthogonal(), v = scene.truth.normal.cross(u);
  for (int i = 0; i < inliers; ++i) {
    scene.points.push_back(-scene.truth.offset * scene.truth.normal + random->Uniform(-1, 1) * u +
                           random->Uniform(-1, 1) * v + noise * RandomNormal(random) * scene.truth.normal);
  }
  for (int i = 0; i < outliers; ++i) {
    scene.points.push_back(-scene.truth.offset * scene.truth.normal + RandomVector(random, 1.5));
  }
  return scene;
}

TEST(FitPlaneTest, FindsThePlaneWithFiftyPercentOutliers) {
  Random random(3);
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const PlanarScene scene = MakePlane(&random, 150, 150, 0.005);
    const auto fit = FitPlane(scene.points, 0.02, seed);
    ASSERT_TRUE(fit);
    EXPECT_NEAR(fit->plane.normal.norm(), 1, 1e-12);
    const double sign = fit->plane.normal.dot(scene.truth.normal) > 0 ? 1 : -1;
    EXPECT_LT(AngleBetween(sign * fit->plane.normal, scene.truth.normal), 0.005);
    EXPECT_NEAR(sign * fit->plane.offset, scene.truth.offset, 0.02);
    EXPECT_GE(fit->inliers, 145);
  }
}

TEST(FitPlaneTest, CountsTheInliersOfThePlaneItReturns) {
  Random random(4);
  const PlanarScene scene = MakePlane(&random, 60, 40, 0.01);
  const auto fit = FitPlane(scene.points, 0.03, 7);
  ASSERT_TRUE(fit);
  int inliers = 0;
  for (const Eigen::Vector3d& point : scene.points) {
    inliers += std::abs(fit->plane.SignedDistance(point)) < 0.03 ? 1 : 0;
  }
  EXPECT_EQ(fit->inliers, inliers);
}

TEST(FitPlaneTest, IsDeterministicForAGivenSeed) {
  Random random(5);
  const PlanarScene scene = MakePlane(&random, 60, 60, 0.01);
  const auto a = FitPlane(scene.points, 0.03, 7), b = FitPlane(scene.points, 0.03, 7);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->plane.normal, b->plane.normal);
  EXPECT_EQ(a->plane.offset, b->plane.offset);
}

TEST(FitPlaneTest, AcceptsThreePointsButNotALine) {
  const std::vector<Eigen::Vector3d> triangle = {{0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
  const auto fit = FitPlane(triangle, 0.01, 1);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(std::abs(fit->plane.normal.z()), 1, 1e-12);
  EXPECT_EQ(fit->inliers, 3);
  const std::vector<Eigen::Vector3d> line = {{0, 0, 1}, {1, 1, 2}, {2, 2, 3}, {3, 3, 4}, {5, 5, 6}};
  EXPECT_FALSE(FitPlane(line, 0.01, 1));
  EXPECT_FALSE(FitPlane(std::vector<Eigen::Vector3d>{{0, 0, 1}, {1, 0, 1}}, 0.01, 1));
}

}  // namespace
}  // namespace docent::engine

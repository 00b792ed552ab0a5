// SPDX-License-Identifier: Apache-2.0
#include "content/placement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "engine/base/random.h"
#include "tests/content/edit_samples.h"

namespace docent::content {
namespace {

constexpr double kPi = std::numbers::pi;

// Points distributed uniformly over a patch: centre + [-half, half] along each of two directions, with noise
// along the third.
std::vector<Eigen::Vector3d> Patch(const Eigen::Vector3d& centre, const Eigen::Vector3d& side1,
                                   const Eigen::Vector3d& side2, int count, double noise, Random* random) {
  const Eigen::Vector3d normal = side1.cross(side2).normalized();
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    points.push_back(centre + random->Uniform(-1, 1) * side1 + random->Uniform(-1, 1) * side2 +
                     random->Uniform(-noise, noise) * normal);
  }
  return points;
}

void Append(const std::vector<Eigen::Vector3d>& more, std::vector<Eigen::Vector3d>* points) {
  points->insert(points->end(), more.begin(), more.end());
}

TEST(FindSurface, HitsASlantedPlaneAtItsIntersectionWithTheRay) {
  Random random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const Eigen::Vector3d normal =
        Eigen::Vector3d(random.Uniform(-1, 1), random.Uniform(-1, 1), -1.5).normalized();
    const Eigen::Vector3d side1 = normal.unitOrthogonal(), side2 = normal.cross(side1);
    const Eigen::Vector3d centre(0.1, -0.2, random.Uniform(0.5, 3));
    const auto points = Patch(centre, side1, side2, 2000, 0.002, &random);
    const Eigen::Vector3d origin(0.05, 0, -0.1);
    const Eigen::Vector3d direction = centre + 0.1 * side1 - origin;
    const SurfaceResult result = FindSurface(points, origin, direction);
    ASSERT_TRUE(result.hit.has_value()) << result.reason;
    EXPECT_TRUE(result.hit->on_plane);
    const Eigen::Vector3d truth = origin + direction * (normal.dot(centre - origin) / normal.dot(direction));
    EXPECT_LT((result.hit->point - truth).norm(), 0.01);
    EXPECT_GT(result.hit->normal.dot(normal), std::cos(5 * kPi / 180));
    EXPECT_LT(result.hit->normal.dot(direction), 0) << "towards the viewer";
  }
}

TEST(FindSurface, UsesTheNearestOfTwoSurfacesOnTheRay) {
  Random random(2);
  std::vector<Eigen::Vector3d> points = Patch({0, 0, 3}, {2, 0, 0}, {0, 2, 0}, 1500, 0.005, &random);
  Append(Patch({0, 0, 1}, {0.1, 0, 0}, {0, 0.1, 0}, 60, 0.002, &random), &points);
  const SurfaceResult front = FindSurface(points, Eigen::Vector3d::Zero(), {0, 0, 1});
  ASSERT_TRUE(front.hit.has_value());
  EXPECT_NEAR(front.hit->point.z(), 1, 0.02);
  // Beyond the edge of the near surface the wall is visible.
  const SurfaceResult beside = FindSurface(points, Eigen::Vector3d::Zero(), {0.14, 0, 1});
  ASSERT_TRUE(beside.hit.has_value());
  EXPECT_NEAR(beside.hit->point.z(), 3, 0.05);
}

TEST(FindSurface, UsesTheSurfaceAtAMeasuredDistance) {
  Random random(2);
  std::vector<Eigen::Vector3d> points = Patch({0, 0, 3}, {2, 0, 0.5}, {0, 2, 0}, 1500, 0.005, &random);
  Append(Patch({0, 0, 1}, {0.1, 0, 0}, {0, 0.1, 0}, 60, 0.002, &random), &points);
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero(), ahead(0, 0, 2);
  const SurfaceResult wall = FindSurface(points, origin, ahead, {}, 3.01);
  ASSERT_TRUE(wall.hit.has_value());
  EXPECT_NEAR((wall.hit->point - Eigen::Vector3d(0, 0, 3.01)).norm(), 0, 1e-12);
  EXPECT_TRUE(wall.hit->on_plane);
  EXPECT_GT(wall.hit->normal.dot(Eigen::Vector3d(1, 0, -4).normalized()), std::cos(5 * kPi / 180));
  const SurfaceResult between = FindSurface(points, origin, ahead, {}, 2);
  ASSERT_TRUE(between.hit.has_value());
  EXPECT_FALSE(between.hit->on_plane) << "no points are at this distance";
  EXPECT_EQ(between.hit->normal, -Eigen::Vector3d::UnitZ());
  EXPECT_TRUE(FindSurface({}, origin, ahead, {}, 2).hit.has_value()) << "even without points";
}

TEST(FindSurface, IsRobustToOutliers) {
  Random random(3);
  std::vector<Eigen::Vector3d> points = Patch({0, 0, 2}, {0.5, 0, 0}, {0, 0.5, 0.2}, 400, 0.004, &random);
  for (int i = 0; i < 40; ++i) {
    points.emplace_back(random.Uniform(-0.3, 0.3), random.Uniform(-0.3, 0.3), random.Uniform(1.8, 2.2));
  }
  const SurfaceResult result = FindSurface(points, Eigen::Vector3d::Zero(), {0, 0, 1});
  ASSERT_TRUE(result.hit.has_value());
  EXPECT_TRUE(result.hit->on_plane);
  EXPECT_NEAR(result.hit->point.z(), 2, 0.03);
}

TEST(FindSurface, UsesTheMedianDepthOfFewPoints) {
  const std::vector<Eigen::Vector3d> points = {{0.01, 0, 2.0}, {-0.01, 0.01, 2.1}, {0, -0.01, 2.05}};
  const SurfaceResult result = FindSurface(points, Eigen::Vector3d::Zero(), {0, 0, 2});
  ASSERT_TRUE(result.hit.has_value());
  EXPECT_FALSE(result.hit->on_plane);
  EXPECT_DOUBLE_EQ(result.hit->point.z(), 2.05);
  EXPECT_DOUBLE_EQ(result.hit->normal.z(), -1);
}

TEST(FindSurface, GivesTheReasonWhenThereIsNoHit) {
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero(), ahead(0, 0, 1);
  EXPECT_FALSE(FindSurface({}, origin, ahead).hit.has_value());
  const std::vector<Eigen::Vector3d> behind = {{0, 0, -1}, {0, 0, -2}, {0.1, 0, -1}, {0, 0.1, -1}};
  EXPECT_EQ(FindSurface(behind, origin, ahead).reason,
            "The map has no points near this pixel; choose a place with more detail.");
  const std::vector<Eigen::Vector3d> aside = {{1, 0, 1}, {1, 0.1, 1}, {1, 0, 1.1}};
  EXPECT_EQ(FindSurface(aside, origin, ahead).reason,
            "The map has no points near this pixel; choose a place with more detail.");
  const std::vector<Eigen::Vector3d> two = {{0, 0, 1}, {0.01, 0, 1}};
  EXPECT_EQ(FindSurface(two, origin, ahead).reason,
            "The map has too few points near this pixel; choose a place with more detail.");
  EXPECT_EQ(FindSurface(two, origin, Eigen::Vector3d::Zero()).reason,
            "The lens does not see anything at this pixel; choose one nearer to the middle of the image.");
}

TEST(FindSurface, IsInvariantToScaleAndPoseOfTheMap) {
  Random random(5);
  const auto points = Patch({0, 0, 2}, {0.5, 0, 0.1}, {0, 0.5, 0.2}, 300, 0.004, &random);
  const SurfaceResult first = FindSurface(points, Eigen::Vector3d::Zero(), {0, 0, 1});
  engine::Sim3 b_from_a;
  b_from_a.rotation = engine::Rotation3::Exp({0.4, -1.1, 0.3});
  b_from_a.translation = {5, -7, 2};
  b_from_a.scale = 13;
  std::vector<Eigen::Vector3d> moved;
  for (const Eigen::Vector3d& point : points) moved.push_back(b_from_a * point);
  const SurfaceResult second =
      FindSurface(moved, b_from_a * Eigen::Vector3d::Zero(), b_from_a.rotation * Eigen::Vector3d::UnitZ());
  ASSERT_TRUE(first.hit && second.hit);
  EXPECT_LT((b_from_a * first.hit->point - second.hit->point).norm(), 13 * 0.002);
  EXPECT_GT((b_from_a.rotation * first.hit->normal).dot(second.hit->normal), 0.999);
}

TEST(UprightPose, IsUprightWithItsFootOnThePointAndFacesAwayFromTheWall) {
  Random random(7);
  for (int trial = 0; trial < 100; ++trial) {
    const auto any = [&] {
      return Eigen::Vector3d(random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1))
          .normalized();
    };
    const Eigen::Vector3d point = any(), normal = any(), up = any();
    const engine::Sim3 pose = UprightPose(point, normal, 3 * up, 0, 0.25);
    EXPECT_LT((pose * Eigen::Vector3d::Zero() - point).norm(), 1e-12);
    EXPECT_LT((pose.rotation * Eigen::Vector3d::UnitY() - up).norm(), 1e-9);
    EXPECT_DOUBLE_EQ(pose.scale, 0.25);
    const Eigen::Vector3d level = normal - up * up.dot(normal);
    if (level.norm() > 0.5) {
      EXPECT_GT((pose.rotation * Eigen::Vector3d::UnitZ()).dot(level.normalized()), 1 - 1e-9);
    }
    // Yaw rotates about up: 90 degrees take the front to the previous direction of the model's x axis.
    const engine::Sim3 turned = UprightPose(point, normal, up, kPi / 2, 0.25);
    EXPECT_LT((turned.rotation * Eigen::Vector3d::UnitZ() - pose.rotation * Eigen::Vector3d::UnitX()).norm(),
              1e-9);
  }
}

TEST(UprightPose, UsesTheSurfaceNormalWithoutAnUpDirection) {
  const Eigen::Vector3d normal(0.6, 0, -0.8);
  const engine::Sim3 pose = UprightPose({1, 2, 3}, normal, Eigen::Vector3d::Zero(), 0, 1);
  EXPECT_LT((pose.rotation * Eigen::Vector3d::UnitY() - normal).norm(), 1e-9);
}

TEST(FacingPose, StandsUprightAndFacesTheViewer) {
  Random random(8);
  const auto any = [&] {
    return Eigen::Vector3d(random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1)).normalized();
  };
  for (int trial = 0; trial < 100; ++trial) {
    const Eigen::Vector3d point = any(), normal = any(), up = any(), viewer = point + 3 * any();
    const engine::Sim3 pose = FacingPose(point, viewer, normal, 2 * up, 0, 0.25);
    EXPECT_LT((pose * Eigen::Vector3d::Zero() - point).norm(), 1e-12);
    EXPECT_LT((pose.rotation * Eigen::Vector3d::UnitY() - up).norm(), 1e-9);
    const Eigen::Vector3d to_viewer = viewer - point;
    const Eigen::Vector3d level = to_viewer - up * up.dot(to_viewer);
    if (level.norm() < 0.2) continue;
    EXPECT_GT((pose.rotation * Eigen::Vector3d::UnitZ()).dot(level.normalized()), 1 - 1e-9);
  }
  // From straight above there is no direction to the viewer: that of the wall is used.
  const engine::Sim3 above = FacingPose({0, 0, 0}, {0, 5, 0}, {1, 0, 0}, {0, 1, 0}, 0, 1);
  EXPECT_LT((above.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 1e-9);
}

TEST(Base, IsTheMiddleOfTheBottomOfTheBoundingBox) {
  const auto asset = AssetWithBox("box");
  EXPECT_EQ(BaseOf(*asset->model), Eigen::Vector3d(1, -1, 2));
  Entity entity = ModelEntity("box");
  EXPECT_EQ(BaseInMap(entity), PlaceOf(entity)) << "the origin of a model that is not loaded";
  entity.model.asset = asset;
  EXPECT_EQ(BaseInMap(entity), Eigen::Vector3d(1 + 2, 2 - 2, 3 + 4));
  EXPECT_DOUBLE_EQ(ScaleForSide(*asset->model, 2), 0.5) << "its largest side has 4 m";
  EXPECT_EQ(ScaleForSide(Model(), 2), 1);
  EXPECT_EQ(ScaleForSide(*asset->model, 1e300), kMaxModelScale);
}

}  // namespace
}  // namespace docent::content

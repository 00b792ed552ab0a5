// SPDX-License-Identifier: Apache-2.0
#include "engine/map/local_points.h"

#include <gtest/gtest.h>

#include <numbers>

#include "engine/base/random.h"

namespace docent::engine {
namespace {

MapSnapshot Cloud(int count, Random* random) {
  MapSnapshot map;
  for (int i = 0; i < count; ++i) {
    MapPoint point;
    point.id = static_cast<MapPointId>(i + 1);
    point.point_in_map << random->Uniform(-1, 1), random->Uniform(-1, 1), random->Uniform(2, 4), 1;
    map.points.push_back(point);
  }
  return map;
}

Sim3 TrueMotion() {
  return {Rotation3::Exp({0.02, -0.05, 0.03}), Eigen::Vector3d(0.1, -0.2, 0.05), 1.07};
}

MapSnapshot CloudMovedBy(const MapSnapshot& map, const Sim3& motion) {
  MapSnapshot moved = map;
  for (MapPoint& point : moved.points) point.point_in_map.head<3>() = motion * point.position();
  return moved;
}

TEST(LocalPoints, AreTheNearestFinitePoints) {
  Random random(1);
  MapSnapshot map = Cloud(200, &random);
  const Eigen::Vector3d place(0.2, 0.1, 2.5);
  for (std::size_t i = 0; i < map.points.size(); i += 3) map.points[i].point_in_map[3] = 0;
  const LocalPoints local = NearestPoints(map, place, 20);
  ASSERT_EQ(local.ids.size(), 20u);
  double farthest = 0;
  for (std::size_t i = 0; i < 20; ++i) {
    const MapPoint* point = map.FindPoint(local.ids[i]);
    ASSERT_TRUE(point && !point->infinite());
    EXPECT_EQ(point->position(), local.positions[i]);
    farthest = std::max(farthest, (point->position() - place).norm());
  }
  int nearer = 0;
  for (const MapPoint& point : map.points)
    nearer += !point.infinite() && (point.position() - place).norm() < farthest;
  EXPECT_EQ(nearer, 19);
  EXPECT_EQ(NearestPoints(map, place, 1000).ids.size(), 133u) << "all finite points";
}

TEST(LocalPoints, RecoverTheMotionOfThatPartOfTheMap) {
  Random random(2);
  const MapSnapshot then = Cloud(100, &random);
  MapSnapshot now = CloudMovedBy(then, TrueMotion());
  // A fifth of the points moved differently, and a fifth was removed.
  for (std::size_t i = 0; i < now.points.size(); i += 5) now.points[i].point_in_map[0] += 0.5;
  std::erase_if(now.points, [](const MapPoint& point) { return point.id % 5 == 0; });
  const auto motion = EstimateMotion(NearestPoints(then, {0, 0, 3}, 80), now);
  ASSERT_TRUE(motion);
  const Eigen::Vector3d place(0.3, -0.4, 2.2);
  EXPECT_LT((*motion * place - TrueMotion() * place).norm(), 1e-9);
  EXPECT_NEAR(motion->scale, TrueMotion().scale, 1e-9);
}

TEST(LocalPoints, GiveNoMotionForTooFewOrCollinearPoints) {
  Random random(3);
  const MapSnapshot then = Cloud(100, &random);
  const LocalPoints local = NearestPoints(then, {0, 0, 3}, 50);
  MapSnapshot few = then;
  few.points.resize(10);
  EXPECT_FALSE(EstimateMotion(local, few));
  EXPECT_FALSE(EstimateMotion(local, MapSnapshot()));
  EXPECT_FALSE(EstimateMotion(LocalPoints(), then));
  MapSnapshot line = then;
  for (MapPoint& point : line.points) point.point_in_map.head<2>().setZero();
  EXPECT_FALSE(EstimateMotion(NearestPoints(line, {0, 0, 3}, 50), line));
}

}  // namespace
}  // namespace docent::engine

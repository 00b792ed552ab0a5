// SPDX-License-Identifier: Apache-2.0
#include "app/session/way_on.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "engine/base/random.h"

namespace docent::app {

namespace {

engine::CameraModel GuideCamera() {
  engine::CameraModel::Intrinsics in;
  in.width_px = 640;
  in.height_px = 480;
  in.fx = in.fy = 500;
  in.cx = 319.5;
  in.cy = 239.5;
  return engine::CameraModel(engine::LensModel::kRadialTangential, in, {});
}

content::Entity SignAt(const Eigen::Vector3d& place, std::uint64_t to_key, const std::string& to_map) {
  content::Entity entity;
  entity.name = to_map;
  entity.kind = content::Entity::Kind::kSignpost;
  entity.signpost.text = "a sign";
  entity.signpost.anchor = place;
  entity.signpost.to_key = to_key;
  entity.signpost.to_map = to_map;
  return entity;
}

TEST(WayOn, IsThatToTheSignpostThatTheCameraHasToTurnLeastFor) {
  content::Scene scene;
  scene.entities = {SignAt({-3, 0, -1}, 1, "Masks"), SignAt({3, 0, 1}, 2, "Lions")};
  const auto way = FindWay(scene, GuideCamera(), {});
  ASSERT_TRUE(way);
  EXPECT_EQ(way->drawn.text, "To Lions");
  EXPECT_GT(way->drawn.arrow.direction.x(), 0.99);
  // After half a turn the other one is nearer, now to the right as well.
  const engine::Rigid3 turned{engine::Rotation3::Exp({0, std::numbers::pi, 0}), {0, 0, 0}};
  const auto other = FindWay(scene, GuideCamera(), turned);
  ASSERT_TRUE(other);
  EXPECT_EQ(other->drawn.text, "To Masks");
  EXPECT_GT(other->drawn.arrow.direction.x(), 0.99);
}

TEST(WayOn, IsNotShownWhereASignpostWithoutADirectionIsSeen) {
  content::Scene scene;
  scene.entities = {SignAt({-3, 0, -1}, 1, "Masks"), SignAt({0, 0, 2}, 2, "Lions")};
  EXPECT_FALSE(FindWay(scene, GuideCamera(), {}));
  scene.entities.back().hidden = true;
  EXPECT_TRUE(FindWay(scene, GuideCamera(), {}));
}

TEST(WayOn, IgnoresSignpostsThatLeadNowhere) {
  content::Scene scene;
  EXPECT_FALSE(FindWay(scene, GuideCamera(), {}));
  scene.entities = {SignAt({3, 0, 1}, 0, "")};
  EXPECT_FALSE(FindWay(scene, GuideCamera(), {}));
}

// A hall (1) with signposts to the lions (2) and the masks (3), from which one leads to the ships (4).
Route RouteThroughTheHall(std::vector<RouteStop> stops) {
  Route route;
  route.stops = std::move(stops);
  for (const auto& [from, to] : {std::pair(1, 2), std::pair(1, 3), std::pair(3, 4)})
    route.signposts.Add(static_cast<std::uint64_t>(from), static_cast<std::uint64_t>(to));
  return route;
}

TEST(WayOn, LeadsToTheNextStopOfATourPastNearerSignposts) {
  content::Scene scene;
  scene.entities = {SignAt({-3, 0, -1}, 3, "Masks"), SignAt({0, 0, 2}, 2, "Lions")};
  RouteState state(RouteThroughTheHall({{3, "Masks"}, {2, "Lions"}}));
  const auto way = FindWay(scene, GuideCamera(), {}, &state);
  ASSERT_TRUE(way) << "another signpost is seen, but not the one that leads on";
  EXPECT_EQ(way->drawn.text, "To Masks");
  EXPECT_LT(way->drawn.arrow.direction.x(), -0.99);
  state.Skip();
  EXPECT_FALSE(FindWay(scene, GuideCamera(), {}, &state)) << "the signpost to the lions is seen";
  state.Skip();
  EXPECT_FALSE(FindWay(scene, GuideCamera(), {}, &state)) << "the tour is finished";
}

TEST(WayOn, LeadsToTheNextStopThroughOtherMaps) {
  content::Scene scene;
  scene.entities = {SignAt({-3, 0, -1}, 3, "Masks"), SignAt({3, 0, 1}, 2, "Lions")};
  RouteState state(RouteThroughTheHall({{4, "Ships"}, {5, "Coins"}}));
  const auto way = FindWay(scene, GuideCamera(), {}, &state);
  ASSERT_TRUE(way);
  EXPECT_EQ(way->drawn.text, "To Ships, through Masks");
  scene.entities[0].hidden = true;
  EXPECT_FALSE(FindWay(scene, GuideCamera(), {}, &state)) << "no signpost that is drawn leads there";
  state.Skip();
  EXPECT_FALSE(FindWay(scene, GuideCamera(), {}, &state)) << "no signpost leads to the coins";
}

// The angle between two directions in the image, degrees.
double AngleBetween_deg(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return std::acos(std::clamp(a.normalized().dot(b.normalized()), -1.0, 1.0)) * 180 / std::numbers::pi;
}

TEST(WayOn, FollowsTheDirectionOfASignpostInView) {
  content::Scene scene;
  scene.entities = {SignAt({-3, 0, -1}, 1, "Masks"), SignAt({0, 0, 2}, 2, "Lions")};
  scene.entities[1].signpost.direction = Eigen::Vector3d(1, 0, 0);
  const auto way = FindWay(scene, GuideCamera(), {});
  ASSERT_TRUE(way);
  EXPECT_TRUE(way->follows_direction);
  EXPECT_EQ(way->signpost, "Lions");
  EXPECT_EQ(way->drawn.text, "To Lions");
  EXPECT_EQ(way->towards, Eigen::Vector3d(1, 0, 0));
  EXPECT_GT(way->drawn.arrow.direction.x(), 0.99);
  EXPECT_GT(way->drawn.arrow.tip.x(), 600) << "at the right edge";
}

TEST(WayOn, LeadsUpIntoTheImageWhereTheDirectionIsAhead) {
  content::Scene scene;
  scene.entities = {SignAt({0.2, 0, 2}, 2, "Lions")};
  const Eigen::Vector3d ahead = Eigen::Vector3d(-0.2, -0.1, 1).normalized();
  scene.entities[0].signpost.direction = ahead;
  const auto way = FindWay(scene, GuideCamera(), {});
  ASSERT_TRUE(way);
  EXPECT_LT((way->drawn.arrow.tip - *GuideCamera().Project(ahead)).norm(), 1e-9);
  EXPECT_LT(way->drawn.arrow.direction.y(), -0.8);
}

TEST(WayOn, PrefersASignpostInViewThatHasADirection) {
  content::Scene scene;
  scene.entities = {SignAt({0, 0, 2}, 1, "Masks"), SignAt({0.5, 0, 2}, 2, "Lions")};
  EXPECT_FALSE(FindWay(scene, GuideCamera(), {}));
  scene.entities[1].signpost.direction = Eigen::Vector3d(0, 0, -1);
  ASSERT_TRUE(FindWay(scene, GuideCamera(), {}));
  EXPECT_EQ(FindWay(scene, GuideCamera(), {})->signpost, "Lions");
}

TEST(WayOn, TurnsWithTheCameraFromManyPoses) {
  // A pose that looks at the sign from somewhere; the arrow must show on which side of the camera's axis what
  // is far away in the sign's direction is.
  Random random(19);
  int at_edge = 0, inside = 0;
  for (int i = 0; i < 2000; ++i) {
    const auto vector = [&] {
      return Eigen::Vector3d(random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(-1, 1));
    };
    content::Scene scene;
    scene.entities = {SignAt(vector(), 2, "Lions")};
    content::Signpost& sign = scene.entities[0].signpost;
    sign.direction = vector().normalized();
    engine::Rigid3 camera_from_map{engine::Rotation3::Exp(3 * vector()), {0, 0, 0}};
    // The board is in front of the camera, somewhere in the image.
    const Eigen::Vector3d seen_at(random.Uniform(-0.8, 0.8), random.Uniform(-0.6, 0.6), 2);
    camera_from_map.translation = seen_at - camera_from_map.rotation * content::BoardMiddle(sign);
    const auto way = FindWay(scene, GuideCamera(), camera_from_map);
    ASSERT_TRUE(way && way->follows_direction);
    const Eigen::Vector3d far_point = content::BoardMiddle(sign) + 1e7 * *sign.direction;
    const Eigen::Vector3d in_camera = camera_from_map * far_point;
    EXPECT_LT((way->towards - in_camera.normalized()).norm(), 1e-5);
    const auto pixel = GuideCamera().Project(in_camera);
    if (pixel && GuideCamera().IsInside(*pixel, 30)) {
      EXPECT_LT((way->drawn.arrow.tip - *pixel).norm(), 0.1);
      ++inside;
    } else if (!pixel || !GuideCamera().IsInside(*pixel)) {
      EXPECT_LT(AngleBetween_deg(way->drawn.arrow.direction, in_camera.head<2>()), 0.1);
      ++at_edge;
    }
  }
  EXPECT_GT(at_edge, 1000);
  EXPECT_GT(inside, 60);
}

}  // namespace

}  // namespace docent::app

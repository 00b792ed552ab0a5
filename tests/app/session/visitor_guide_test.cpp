// SPDX-License-Identifier: Apache-2.0
#include "app/session/visitor_guide.h"

#include <gtest/gtest.h>

#include <numbers>
#include <utility>

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

TEST(WayOutOfSight, IsThatToTheSignpostThatTheCameraHasToTurnLeastFor) {
  content::Scene scene;
  scene.entities = {SignAt({-3, 0, -1}, 1, "Masks"), SignAt({3, 0, 1}, 2, "Lions")};
  const auto way = WayOutOfSight(scene, GuideCamera(), {});
  ASSERT_TRUE(way);
  EXPECT_EQ(way->text, "To Lions");
  EXPECT_GT(way->arrow.direction.x(), 0.99);
  // After half a turn the other one is nearer, now to the right as well.
  const engine::Rigid3 turned{engine::Rotation3::Exp({0, std::numbers::pi, 0}), {0, 0, 0}};
  const auto other = WayOutOfSight(scene, GuideCamera(), turned);
  ASSERT_TRUE(other);
  EXPECT_EQ(other->text, "To Masks");
  EXPECT_GT(other->arrow.direction.x(), 0.99);
}

TEST(WayOutOfSight, IsNotShownWhereASignpostIsSeen) {
  content::Scene scene;
  scene.entities = {SignAt({-3, 0, -1}, 1, "Masks"), SignAt({0, 0, 2}, 2, "Lions")};
  EXPECT_FALSE(WayOutOfSight(scene, GuideCamera(), {}));
  scene.entities.back().hidden = true;
  EXPECT_TRUE(WayOutOfSight(scene, GuideCamera(), {}));
}

TEST(WayOutOfSight, IgnoresSignpostsThatLeadNowhere) {
  content::Scene scene;
  EXPECT_FALSE(WayOutOfSight(scene, GuideCamera(), {}));
  scene.entities = {SignAt({3, 0, 1}, 0, "")};
  EXPECT_FALSE(WayOutOfSight(scene, GuideCamera(), {}));
}

// A hall (1) with signposts to the lions (2) and the masks (3), from which one leads to the ships (4).
Route RouteThroughTheHall(std::vector<RouteStop> stops) {
  Route route;
  route.stops = std::move(stops);
  for (const auto& [from, to] : {std::pair(1, 2), std::pair(1, 3), std::pair(3, 4)})
    route.signposts.Add(static_cast<std::uint64_t>(from), static_cast<std::uint64_t>(to));
  return route;
}

TEST(WayOutOfSight, LeadsToTheNextStopOfATourPastNearerSignposts) {
  content::Scene scene;
  scene.entities = {SignAt({-3, 0, -1}, 3, "Masks"), SignAt({0, 0, 2}, 2, "Lions")};
  RouteState state(RouteThroughTheHall({{3, "Masks"}, {2, "Lions"}}));
  const auto way = WayOutOfSight(scene, GuideCamera(), {}, &state);
  ASSERT_TRUE(way) << "another signpost is seen, but not the one that leads on";
  EXPECT_EQ(way->text, "To Masks");
  EXPECT_LT(way->arrow.direction.x(), -0.99);
  state.Skip();
  EXPECT_FALSE(WayOutOfSight(scene, GuideCamera(), {}, &state)) << "the signpost to the lions is seen";
  state.Skip();
  EXPECT_FALSE(WayOutOfSight(scene, GuideCamera(), {}, &state)) << "the tour is finished";
}

TEST(WayOutOfSight, LeadsToTheNextStopThroughOtherMaps) {
  content::Scene scene;
  scene.entities = {SignAt({-3, 0, -1}, 3, "Masks"), SignAt({3, 0, 1}, 2, "Lions")};
  RouteState state(RouteThroughTheHall({{4, "Ships"}, {5, "Coins"}}));
  const auto way = WayOutOfSight(scene, GuideCamera(), {}, &state);
  ASSERT_TRUE(way);
  EXPECT_EQ(way->text, "To Ships, through Masks");
  scene.entities[0].hidden = true;
  EXPECT_FALSE(WayOutOfSight(scene, GuideCamera(), {}, &state)) << "no signpost that is drawn leads there";
  state.Skip();
  EXPECT_FALSE(WayOutOfSight(scene, GuideCamera(), {}, &state)) << "no signpost leads to the coins";
}

}  // namespace

}  // namespace docent::app

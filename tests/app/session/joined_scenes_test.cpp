// SPDX-License-Identifier: Apache-2.0
#include "app/session/joined_scenes.h"

#include <gtest/gtest.h>

#include "content/edit_history.h"
#include "content/edits.h"
#include "engine/base/random.h"

namespace docent::app {
namespace {

using engine::Sim3;

content::Entity Sign(const std::string& name, const std::string& to_map, const Eigen::Vector3d& anchor) {
  content::Entity sign;
  sign.name = name;
  sign.signpost.text = "this way";
  sign.signpost.anchor = anchor;
  sign.signpost.height = 0.2;
  sign.signpost.to_map = to_map;
  return sign;
}

maps::MapInfo Map(std::uint64_t key, const std::string& name) {
  maps::MapInfo info;
  info.key = key;
  info.name = name;
  return info;
}

// A joined map whose points were not moved by the adjustment.
engine::JoinedMap Joined(const Sim3& a_from_b) {
  Random random(1);
  auto map = std::make_shared<engine::MapSnapshot>();
  for (std::uint32_t i = 0; i < 400; ++i) {
    engine::MapPoint point;
    point.id = i;
    point.point_in_map << random.Uniform(-3, 3), random.Uniform(-3, 3), random.Uniform(2, 4), 1;
    map->points.push_back(point);
  }
  engine::JoinedMap joined;
  joined.map = joined.aligned = map;
  joined.a_from_b = a_from_b;
  return joined;
}

TEST(JoinedScenes, HoldTheContentOfBothMapsInTheCoordinatesOfTheFirst) {
  content::Scene a, b;
  a.entities = {Sign("sign-1", "", {0.5, 0.2, 3})};
  b.entities = {Sign("sign-1", "Garden", {1, 2, 3})};
  b.entities[0].signpost.direction = Eigen::Vector3d(0, 0.6, 0.8);
  content::Entity model;
  model.name = "fox";
  model.kind = content::Entity::Kind::kModel;
  model.model.map_from_model = {engine::Rotation3::Exp({0, 0.3, 0}), {0.2, 0.1, 2.8}, 0.3};
  b.entities.push_back(model);
  const Sim3 a_from_b{engine::Rotation3::Exp({0.2, -0.5, 0.1}), {1, -2, 0.5}, 2.5};
  const content::Scene both = JoinScenes(a, b, Map(1, "East"), Map(2, "West"), Joined(a_from_b));
  ASSERT_EQ(both.entities.size(), 3u);
  EXPECT_EQ(both.Find("sign-1")->signpost.anchor, a.entities[0].signpost.anchor);
  const content::Signpost& moved = both.Find("sign-1-2")->signpost;
  EXPECT_LT((moved.anchor - a_from_b * Eigen::Vector3d(1, 2, 3)).norm(), 1e-9);
  EXPECT_NEAR(moved.height, 0.5, 1e-9);
  EXPECT_LT((moved.up - a_from_b.rotation * b.entities[0].signpost.up).norm(), 1e-9);
  EXPECT_EQ(moved.to_map, "Garden");
  EXPECT_LT((moved.direction.value() - a_from_b.rotation * Eigen::Vector3d(0, 0.6, 0.8)).norm(), 1e-9);
  const Sim3 fox = both.Find("fox")->model.map_from_model, wanted = a_from_b * model.model.map_from_model;
  EXPECT_LT((fox.translation - wanted.translation).norm(), 1e-9);
  EXPECT_LT((fox.rotation * wanted.rotation.inverse()).Angle(), 1e-9);
  EXPECT_NEAR(fox.scale, 0.75, 1e-9);
}

TEST(JoinedScenes, KeepGroupsOfTheSameNameApart) {
  content::Scene a, b;
  a.entities = {Sign("sign-1", "", {0.5, 0.2, 3}), Sign("sign-2", "", {0, 0, 3})};
  for (content::Entity& entity : a.entities) entity.group = "group-1";
  b.entities = {Sign("sign-3", "", {1, 2, 3}), Sign("sign-4", "", {1, 1, 3}), Sign("sign-5", "", {0, 1, 3}),
                Sign("sign-6", "", {0, 1, 2})};
  b.entities[0].group = b.entities[1].group = "group-1";
  b.entities[2].group = "group-1-2";
  const content::Scene both = JoinScenes(a, b, Map(1, "East"), Map(2, "West"), Joined({}));
  EXPECT_EQ(both.Find("sign-1")->group, "group-1");
  EXPECT_EQ(both.Find("sign-2")->group, "group-1");
  EXPECT_EQ(both.Find("sign-3")->group, "group-1-3");
  EXPECT_EQ(both.Find("sign-4")->group, "group-1-3");
  EXPECT_EQ(both.Find("sign-5")->group, "group-1-2");
  EXPECT_EQ(both.Find("sign-6")->group, "");
}

TEST(JoinedScenes, LeaveTheNamesThatUndoNeeds) {
  content::Scene a, b;
  content::EditHistory history;
  history.Do(content::AddEdit(a, Sign("sign-1", "", {0.5, 0.2, 3})), &a);
  history.Do(content::RemoveEdit(a, {"sign-1"}), &a);
  b.entities = {Sign("sign-1", "Garden", {1, 2, 3})};
  MergeScene(b, Map(1, "East"), Map(2, "West"), Joined({}), history.Names(), &a);
  ASSERT_NE(a.Find("sign-1-2"), nullptr);
  EXPECT_EQ(a.Find("sign-1-2")->signpost.to_map, "Garden");
  ASSERT_TRUE(history.Undo(&a));
  EXPECT_NE(a.Find("sign-1"), nullptr);
}

TEST(JoinedScenes, HaveNoSignpostToTheirOwnMap) {
  content::Scene a, b;
  a.entities = {Sign("sign-1", "West", {0.5, 0.2, 3})};
  b.entities = {Sign("sign-2", "East", {1, 2, 3})};
  for (content::Scene* const scene : {&a, &b})
    scene->entities[0].signpost.direction = Eigen::Vector3d(1, 0, 0);
  const content::Scene both = JoinScenes(a, b, Map(1, "East"), Map(2, "West"), Joined({}));
  EXPECT_EQ(both.Find("sign-1")->signpost.to_map, "");
  EXPECT_EQ(both.Find("sign-2")->signpost.to_map, "");
  for (const content::Entity& sign : both.entities) EXPECT_FALSE(sign.signpost.direction) << sign.name;
}

TEST(JoinedScenes, RedirectSignpostsOfOtherMapsToTheJoinedOne) {
  content::Scene hall;
  hall.entities = {Sign("sign-1", "West", {0, 0, 1}), Sign("sign-2", "Garden", {0, 0, 2})};
  content::Entity renamed = Sign("sign-3", "old name", {0, 0, 3});
  renamed.signpost.to_key = 2;
  renamed.signpost.direction = Eigen::Vector3d(0, 0, 1);
  hall.entities.push_back(renamed);
  EXPECT_TRUE(RedirectSceneSignposts(Map(2, "West"), Map(1, "East"), &hall));
  EXPECT_EQ(hall.Find("sign-1")->signpost.to_map, "East");
  EXPECT_EQ(hall.Find("sign-1")->signpost.to_key, 1u);
  EXPECT_EQ(hall.Find("sign-2")->signpost.to_map, "Garden");
  EXPECT_EQ(hall.Find("sign-3")->signpost.to_map, "East");
  EXPECT_EQ(hall.Find("sign-3")->signpost.to_key, 1u);
  EXPECT_EQ(hall.Find("sign-3")->signpost.direction, Eigen::Vector3d(0, 0, 1)) << "the way there is the same";
  EXPECT_FALSE(RedirectSceneSignposts(Map(7, "Attic"), Map(1, "East"), &hall));
}

}  // namespace
}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#include "app/session/content_follower.h"

#include <gtest/gtest.h>

#include "app/session/session_map.h"
#include "content/edits.h"
#include "engine/base/random.h"
#include "engine/map/map.h"

namespace docent::app {
namespace {

using engine::MapSnapshot;
using engine::Sim3;

std::shared_ptr<MapSnapshot> Cloud() {
  Random random(1);
  auto map = std::make_shared<MapSnapshot>();
  for (int i = 0; i < 400; ++i) {
    engine::MapPoint point;
    point.id = static_cast<engine::MapPointId>(i + 1);
    point.point_in_map << random.Uniform(-1, 1), random.Uniform(-1, 1), random.Uniform(2, 4), 1;
    map->points.push_back(point);
  }
  return map;
}

std::shared_ptr<MapSnapshot> Moved(const MapSnapshot& map, const Sim3& motion, double noise = 0,
                                   std::uint64_t seed = 1) {
  Random random(seed);
  auto moved = std::make_shared<MapSnapshot>(map);
  for (engine::MapPoint& point : moved->points) {
    point.point_in_map.head<3>() = motion * point.position() + Eigen::Vector3d(random.Uniform(-noise, noise),
                                                                               random.Uniform(-noise, noise),
                                                                               random.Uniform(-noise, noise));
  }
  return moved;
}

Sim3 Bend() {
  return {engine::Rotation3::Exp({0.01, -0.04, 0.02}), Eigen::Vector3d(0.05, -0.1, 0.2), 0.95};
}

content::Scene TwoThings() {
  content::Scene scene;
  content::Entity model, sign;
  model.name = "fox";
  model.kind = content::Entity::Kind::kModel;
  auto asset = std::make_shared<content::Asset>();
  asset->id = "abc";
  model.model.asset = asset;
  model.model.map_from_model = {engine::Rotation3(), {0.2, 0.1, 2.8}, 0.3};
  sign.name = "sign-1";
  sign.signpost.anchor = {-0.3, 0.2, 3.1};
  sign.signpost.height = 0.2;
  scene.entities = {model, sign};
  return scene;
}

SessionMap MapWithContent() {
  SessionMap map;
  map.snapshot = Cloud();
  map.scene = std::make_shared<content::Scene>(TwoThings());
  return map;
}

TEST(ContentFollower, MovesContentWithItsAnchor) {
  SessionMap map = MapWithContent();
  const content::Scene before = *map.scene;
  map.UpdateSnapshot(Moved(*map.snapshot, Bend()));
  const Sim3 model = map.scene->Find("fox")->model.map_from_model;
  const Sim3 wanted = Bend() * before.Find("fox")->model.map_from_model;
  EXPECT_LT((model.translation - wanted.translation).norm(), 1e-9);
  EXPECT_NEAR(model.scale, wanted.scale, 1e-9);
  EXPECT_LT((model.rotation * wanted.rotation.inverse()).Angle(), 1e-9);
  const content::Signpost& sign = map.scene->Find("sign-1")->signpost;
  EXPECT_LT((sign.anchor - Bend() * before.Find("sign-1")->signpost.anchor).norm(), 1e-9);
  EXPECT_NEAR(sign.height, 0.95 * 0.2, 1e-9);
}

TEST(ContentFollower, KeepsTheSceneWhileNothingMoves) {
  SessionMap map = MapWithContent();
  const auto scene = map.scene;
  map.UpdateSnapshot(std::make_shared<MapSnapshot>(*map.snapshot));
  EXPECT_EQ(map.scene, scene) << "otherwise it would be saved again with every keyframe";
}

// A thousand adjustments, each of which moves every point randomly about its true position.
TEST(ContentFollower, DoesNotAccumulateErrorsOverManyAdjustments) {
  SessionMap map = MapWithContent();
  const auto truth = map.snapshot;
  const Eigen::Vector3d placed = content::PlaceOf(*map.scene->Find("fox"));
  double farthest = 0;
  for (std::uint64_t i = 1; i <= 1000; ++i) {
    map.UpdateSnapshot(Moved(*truth, Sim3(), 0.01, i));
    farthest = std::max(farthest, (content::PlaceOf(*map.scene->Find("fox")) - placed).norm());
  }
  EXPECT_LT(farthest, 0.004) << "anchored to 150 points with an error of 0.01 map units each";
  map.UpdateSnapshot(truth);
  EXPECT_LT((content::PlaceOf(*map.scene->Find("fox")) - placed).norm(), 1e-9);
}

TEST(ContentFollower, FollowsContentFromItsNewPlaceAfterAnEdit) {
  SessionMap map = MapWithContent();
  map.UpdateSnapshot(Moved(*map.snapshot, Bend()));
  auto scene = std::make_shared<content::Scene>(*map.scene);
  map.history.Do(content::MoveEdit(*scene, "fox", {-0.5, 0.4, 2.6}), scene.get());
  map.scene = scene;
  map.UpdateSnapshot(Moved(*map.snapshot, Bend()));
  EXPECT_LT((content::PlaceOf(*map.scene->Find("fox")) - Bend() * Eigen::Vector3d(-0.5, 0.4, 2.6)).norm(),
            1e-9);
  scene = std::make_shared<content::Scene>(*map.scene);
  ASSERT_TRUE(map.history.Undo(scene.get()));
  const Eigen::Vector3d wanted = Bend() * (Bend() * Eigen::Vector3d(0.2, 0.1, 2.8));
  EXPECT_LT((content::PlaceOf(*scene->Find("fox")) - wanted).norm(), 1e-9)
      << "undo returns it to its first place, moved by both adjustments";
}

// Of both things, one after the other, and then both at once, so that the scene is empty.
TEST(ContentFollower, WhatWasRemovedIsRestoredAtItsNewPlace) {
  for (const auto& removed :
       {std::vector<std::string>{"fox"}, std::vector<std::string>{"sign-1"}, {"fox", "sign-1"}}) {
    SessionMap map = MapWithContent();
    auto scene = std::make_shared<content::Scene>(*map.scene);
    map.history.Do(content::MoveEdit(*scene, removed.front(), {-0.5, 0.4, 2.6}), scene.get());
    map.history.Do(content::RemoveEdit(*scene, removed), scene.get());
    map.scene = scene;
    const auto before = map.scene;
    map.UpdateSnapshot(Moved(*map.snapshot, Bend()));
    EXPECT_NE(map.scene, before) << "the history is saved with the scene";
    scene = std::make_shared<content::Scene>(*map.scene);
    ASSERT_TRUE(map.history.Undo(scene.get()));
    const auto place = [&](const std::string& name) { return content::PlaceOf(*scene->Find(name)); };
    EXPECT_LT((place(removed.front()) - Bend() * Eigen::Vector3d(-0.5, 0.4, 2.6)).norm(), 1e-9);
    ASSERT_TRUE(map.history.Undo(scene.get()));
    const content::Scene placed = TwoThings();
    for (const char* name : {"fox", "sign-1"})
      EXPECT_LT((place(name) - Bend() * content::PlaceOf(*placed.Find(name))).norm(), 1e-9) << name;
  }
}

TEST(ContentFollower, WhatWasAddedAndUndoneIsAddedAgainAtItsNewPlace) {
  SessionMap map;
  map.snapshot = Cloud();
  auto scene = std::make_shared<content::Scene>();
  map.history.Do(content::AddEdit(*scene, TwoThings().entities[0]), scene.get());
  map.history.Do(content::MoveEdit(*scene, "fox", {-0.5, 0.4, 2.6}), scene.get());
  ASSERT_TRUE(map.history.Undo(scene.get()));
  ASSERT_TRUE(map.history.Undo(scene.get()));
  map.scene = scene;
  for (int i = 0; i < 2; ++i) map.UpdateSnapshot(Moved(*map.snapshot, Bend()));
  scene = std::make_shared<content::Scene>(*map.scene);
  const auto distance = [&](const Eigen::Vector3d& placed) {
    return (content::PlaceOf(*scene->Find("fox")) - Bend() * (Bend() * placed)).norm();
  };
  ASSERT_TRUE(map.history.Redo(scene.get()));
  EXPECT_LT(distance({0.2, 0.1, 2.8}), 1e-9);
  ASSERT_TRUE(map.history.Redo(scene.get()));
  EXPECT_LT(distance({-0.5, 0.4, 2.6}), 1e-9);
}

// Loop closing moves one part of the map by several percent while another stays, and removes a large part of
// the points as duplicates.
TEST(ContentFollower, FollowsTheMapWhenALoopIsClosed) {
  auto snapshot = Cloud();
  for (const engine::MapPoint& point : std::vector(snapshot->points)) {
    engine::MapPoint& other = snapshot->points.emplace_back(point);
    other.id += 400;
    other.source_keyframe = 1;
    other.point_in_map.x() += 2.2;
  }
  for (engine::KeyFrameId id : {0u, 1u}) {
    engine::KeyFrame& keyframe = snapshot->keyframes.emplace_back();
    keyframe.id = id;
    keyframe.mean_depth = 3;
  }
  snapshot->next_keyframe = 2;
  snapshot->next_point = 801;
  SessionMap map;
  map.snapshot = snapshot;
  content::Scene scene = TwoThings();
  scene.entities[0].model.map_from_model.translation = {2.0, 0.1, 2.8};
  map.scene = std::make_shared<content::Scene>(scene);
  engine::Map closed(*snapshot);
  closed.Correct({{1, Bend()}});
  for (engine::MapPointId id = 401; id <= 800; id += 2) closed.RemovePoint(id);
  map.UpdateSnapshot(closed.Snapshot());
  const Eigen::Vector3d wanted = Bend() * scene.entities[0].model.map_from_model.translation;
  EXPECT_GT((wanted - content::PlaceOf(scene.entities[0])).norm(), 0.2);
  EXPECT_LT((content::PlaceOf(*map.scene->Find("fox")) - wanted).norm(), 1e-3);
  EXPECT_NEAR(map.scene->Find("fox")->model.map_from_model.scale, 0.95 * 0.3, 1e-3);
  EXPECT_LT((content::PlaceOf(*map.scene->Find("sign-1")) - content::PlaceOf(scene.entities[1])).norm(), 1e-3)
      << "it is in the part that does not move";
}

TEST(ContentFollower, KeepsContentInPlaceWhenItsAnchorPointsAreRemoved) {
  SessionMap map = MapWithContent();
  const content::Scene before = *map.scene;
  auto other = Moved(*map.snapshot, Bend());
  for (engine::MapPoint& point : other->points) point.id += 1000;
  map.UpdateSnapshot(other);
  EXPECT_EQ(content::PlaceOf(*map.scene->Find("fox")), content::PlaceOf(*before.Find("fox")));
  // From now on these points are its anchor.
  map.UpdateSnapshot(Moved(*other, Bend()));
  EXPECT_LT(
      (content::PlaceOf(*map.scene->Find("fox")) - Bend() * content::PlaceOf(*before.Find("fox"))).norm(),
      1e-9);
}

}  // namespace
}  // namespace docent::app

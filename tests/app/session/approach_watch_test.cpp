// SPDX-License-Identifier: Apache-2.0
#include "app/session/approach_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace docent::app {
namespace {

using ::testing::IsEmpty;
using ::testing::Pair;
using ::testing::UnorderedElementsAre;

// An animated model at the origin, whose sphere has a radius of 1 in the map.
content::Scene AnimatedScene() {
  auto model = std::make_shared<content::Model>();
  const float half = 1 / std::sqrt(3.0f);
  model->bounds_min = glm::vec3(-half);
  model->bounds_max = glm::vec3(half);
  model->animations.emplace_back();
  auto asset = std::make_shared<content::Asset>();
  asset->model = model;
  content::Scene scene;
  content::Entity& entity = scene.entities.emplace_back();
  entity.name = "clock";
  entity.kind = content::Entity::Kind::kModel;
  entity.model.asset = asset;
  return scene;
}

// How far away one sees it span this angle.
Eigen::Vector3d WhereItSpans(double degrees) {
  return {0, 0, -1 / std::tan(0.5 * degrees * std::numbers::pi / 180)};
}

TEST(ApproachWatch, AnAnimationBeginsWhenOneComesNearAndAnewAfterOneWentAway) {
  const content::Scene scene = AnimatedScene();
  ApproachWatch watch;
  EXPECT_THAT(*watch.Update(1, 5, scene, WhereItSpans(9.9)), IsEmpty());
  EXPECT_THAT(*watch.Update(2, 5, scene, WhereItSpans(10.1)), UnorderedElementsAre(Pair("clock", 2)));
  EXPECT_THAT(*watch.Update(3, 5, scene, WhereItSpans(30)), UnorderedElementsAre(Pair("clock", 2)));
  EXPECT_THAT(*watch.Update(4, 5, scene, WhereItSpans(7.1)), UnorderedElementsAre(Pair("clock", 2)))
      << "who sways does not start it anew";
  EXPECT_THAT(*watch.Update(5, 5, scene, std::nullopt), UnorderedElementsAre(Pair("clock", 2)))
      << "a lost camera changes nothing";
  EXPECT_THAT(*watch.Update(6, 5, scene, WhereItSpans(6.9)), IsEmpty());
  EXPECT_THAT(*watch.Update(7, 5, scene, WhereItSpans(11)), UnorderedElementsAre(Pair("clock", 7)));
}

TEST(ApproachWatch, AnotherMapBeginsAnew) {
  const content::Scene scene = AnimatedScene();
  ApproachWatch watch;
  watch.Update(1, 5, scene, WhereItSpans(20));
  EXPECT_THAT(*watch.Update(2, 6, scene, WhereItSpans(20)), UnorderedElementsAre(Pair("clock", 2)));
}

TEST(ApproachWatch, WhatIsHiddenOrNotAnimatedHasNoBeginning) {
  content::Scene scene = AnimatedScene();
  scene.entities[0].hidden = true;
  ApproachWatch watch;
  EXPECT_THAT(*watch.Update(1, 5, scene, WhereItSpans(20)), IsEmpty());
  scene.entities[0].hidden = false;
  scene.entities[0].kind = content::Entity::Kind::kImage;
  EXPECT_THAT(*watch.Update(2, 5, scene, WhereItSpans(20)), IsEmpty());
}

}  // namespace
}  // namespace docent::app

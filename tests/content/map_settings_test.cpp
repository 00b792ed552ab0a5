// SPDX-License-Identifier: Apache-2.0
#include "content/map_settings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "content/edit_history.h"
#include "content/edits.h"
#include "content/history_codec.h"
#include "content/placement.h"
#include "content/scene_codec.h"
#include "engine/base/error.h"

namespace docent::content {

namespace {

using ::testing::HasSubstr;

std::shared_ptr<const Asset> NoAsset(const std::string&) {
  return nullptr;
}

MapSettings Example() {
  MapSettings settings;
  settings.up = Eigen::Vector3d(0, -0.6, 0.8);
  settings.metres_per_unit = 0.25;
  settings.entrance = 4'000'000'000;
  return settings;
}

TEST(MapSettings, AreStoredWithTheSceneAndReadBack) {
  Scene scene;
  scene.settings = Example();
  const std::string text = EncodeScene(scene);
  EXPECT_EQ(DecodeScene(text, "desk", NoAsset).settings, scene.settings);
  std::vector<std::string> problems;
  EXPECT_EQ(ReadScene(text, "desk", NoAsset, &problems).settings, scene.settings);
  EXPECT_TRUE(problems.empty());
  EXPECT_THAT(EncodeScene(Scene()), ::testing::Not(HasSubstr("settings")));
}

TEST(MapSettings, AreRefusedWhereTheyMeanNothing) {
  Scene scene;
  scene.settings.up = Eigen::Vector3d(0, 2, 0);
  EXPECT_THROW(EncodeScene(scene), Error);
  for (const double metres :
       {-1.0, 1e-9, 1e9, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    scene.settings = {};
    scene.settings.metres_per_unit = metres;
    EXPECT_THROW(EncodeScene(scene), Error) << metres;
  }
  const auto read = [](const std::string& settings) {
    return DecodeScene(R"({"docent_scene":3,"assets":[],"entities":[],"settings":)" + settings + "}", "desk",
                       NoAsset);
  };
  EXPECT_NO_THROW(read(R"({"up":[0,-1,0],"metres_per_unit":1})"));
  for (const char* wrong :
       {"7", "{}", R"({"up":[0,-1],"metres_per_unit":1})", R"({"up":[0,-2,0],"metres_per_unit":1})",
        R"({"up":null,"metres_per_unit":1e9})", R"({"up":null,"metres_per_unit":"1"})",
        R"({"up":null,"metres_per_unit":1,"entrance":-1})",
        R"({"up":null,"metres_per_unit":1,"entrance":4294967296})",
        R"({"up":null,"metres_per_unit":1,"entrance":null})", R"({"up":null,"metres_per_unit":1,"more":1})"})
    EXPECT_THROW(read(wrong), Error) << wrong;
  EXPECT_THROW(
      DecodeScene(
          R"({"docent_scene":2,"assets":[],"entities":[],"settings":{"up":null,"metres_per_unit":1}})",
          "desk", NoAsset),
      Error);
}

TEST(MapSettings, CostOnlyThemselvesWhereTheyAreDamaged) {
  std::vector<std::string> problems;
  const Scene scene = ReadScene(
      R"({"docent_scene":3,"assets":[],"entities":[],"settings":{"up":[9,9,9],"metres_per_unit":1}})", "desk",
      NoAsset, &problems);
  EXPECT_EQ(scene.settings, MapSettings());
  EXPECT_EQ(problems.size(), 1u);
}

TEST(MapSettings, ChangesAreUndoneAlsoAfterTheyWereStored) {
  Scene scene;
  EditHistory history;
  history.Do(SettingsEdit(scene, Example(), "set the scale"), &scene);
  EXPECT_EQ(scene.settings, Example());
  EXPECT_THROW(SettingsEdit(scene, Example(), "again"), Error);
  const std::string text = EncodeHistory(history, 10'000);
  EditHistory stored = DecodeHistory(text, "desk", NoAsset);
  ASSERT_TRUE(stored.Undo(&scene));
  EXPECT_EQ(scene.settings, MapSettings());
  ASSERT_TRUE(stored.Redo(&scene));
  EXPECT_EQ(scene.settings, Example());
}

TEST(MapSettings, ThatWereNotSetByAChangeStayWhenChangesAreUndoneAndRedone) {
  Scene scene;
  EditHistory history;
  MapSettings settings;
  settings.entrance = 7;
  history.Do(SettingsEdit(scene, settings, "choose the entrance view"), &scene);
  settings.up = Eigen::Vector3d::UnitY();
  history.Do(SettingsEdit(scene, settings, "set the up direction"), &scene);
  ASSERT_TRUE(history.Undo(&scene));
  // As when another map is joined into this one.
  scene.settings.up = Eigen::Vector3d::UnitX();
  scene.settings.metres_per_unit = 0.5;
  history.AddSettings(scene.settings);
  ASSERT_TRUE(history.Undo(&scene));
  EXPECT_FALSE(scene.settings.entrance);
  EXPECT_EQ(scene.settings.up, Eigen::Vector3d(Eigen::Vector3d::UnitX()));
  EXPECT_EQ(scene.settings.metres_per_unit, 0.5);
  ASSERT_TRUE(history.Redo(&scene));
  ASSERT_TRUE(history.Redo(&scene));
  EXPECT_EQ(scene.settings.entrance, 7u);
  EXPECT_EQ(scene.settings.up, Eigen::Vector3d(Eigen::Vector3d::UnitY())) << "the author's own one";
  EXPECT_EQ(scene.settings.metres_per_unit, 0.5);
}

TEST(MapSettings, FollowAChangeOfTheMapsCoordinates) {
  // A quarter turn about z, and units of half the length.
  const engine::Sim3 motion{engine::Rotation3::Exp({0, 0, 0.5 * std::numbers::pi}), {1, 2, 3}, 2};
  MapSettings settings;
  settings.up = Eigen::Vector3d::UnitX();
  settings.metres_per_unit = 0.5;
  const MapSettings after = Transformed(motion, settings);
  EXPECT_LT((*after.up - Eigen::Vector3d::UnitY()).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(after.metres_per_unit, 0.25);
  EXPECT_EQ(Transformed(motion, {}), MapSettings());
}

TEST(MapSettings, GiveModelsTheirTrueSize) {
  Model model;
  model.bounds_min = {0, 0, 0};
  model.bounds_max = {2, 4, 1};
  EXPECT_DOUBLE_EQ(AutomaticScale(model, {}, 1), 0.25);
  // A map unit of 25 cm: a metre of the model is four units.
  EXPECT_DOUBLE_EQ(AutomaticScale(model, Example(), 1), 4);
}

}  // namespace

}  // namespace docent::content

// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "content/scene_codec.h"
#include "engine/base/error.h"

namespace docent::content {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::shared_ptr<const Asset> MakeTestAsset(const std::string& id) {
  auto asset = std::make_shared<Asset>();
  asset->id = id;
  return asset;
}

Scene TestScene() {
  Scene scene;
  Entity model;
  model.kind = Entity::Kind::kModel;
  model.name = "helmet";
  model.model.asset = MakeTestAsset("abc");
  model.model.animation = -1;
  model.model.map_from_model.rotation = engine::Rotation3::Exp({0.1, -0.7, 0.3});
  model.model.map_from_model.translation = {1.0 / 3, -2e-17, 12345.678901234567};
  model.model.map_from_model.scale = 0.1;
  scene.entities.push_back(model);
  Entity sign;
  sign.name = "sign \"1\"";
  sign.signpost.text = "Zum Café →\nzweite Zeile";
  sign.signpost.anchor = {0.1, 0.2, 0.3};
  sign.signpost.up = Eigen::Vector3d(1, 2, 3).normalized();
  sign.signpost.height_m = 0.07;
  sign.signpost.to_map = "Desk 3";
  scene.entities.push_back(sign);
  return scene;
}

AssetLookup Known() {
  return [](const std::string& id) { return id == "abc" ? MakeTestAsset(id) : nullptr; };
}

std::string Refusal(const std::string& text) {
  try {
    DecodeScene(text, "the library", Known());
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Scene, FreeNamesCountUpwards) {
  Scene scene;
  EXPECT_EQ(scene.FreeName("cat"), "cat");
  for (const char* name : {"cat", "cat-2", "cat-4"}) scene.entities.emplace_back().name = name;
  EXPECT_EQ(scene.FreeName("cat"), "cat-3");
  EXPECT_NE(scene.Find("cat-4"), nullptr);
  EXPECT_EQ(scene.Find("dog"), nullptr);
}

TEST(SceneCodec, DecodingReproducesTheNumbersExactly) {
  const Scene scene = TestScene();
  const std::string text = EncodeScene(scene);
  EXPECT_THAT(SceneAssetIds(text), ElementsAre("abc"));
  const Scene read = DecodeScene(text, "the library", Known());
  ASSERT_EQ(read.entities.size(), 2u);
  const PlacedModel& model = read.entities[0].model;
  EXPECT_EQ(read.entities[0].kind, Entity::Kind::kModel);
  EXPECT_EQ(model.asset->id, "abc");
  EXPECT_EQ(model.animation, -1);
  EXPECT_EQ(model.map_from_model.translation, scene.entities[0].model.map_from_model.translation);
  EXPECT_EQ(model.map_from_model.scale, 0.1);
  const engine::Rotation3 difference =
      model.map_from_model.rotation.inverse() * scene.entities[0].model.map_from_model.rotation;
  EXPECT_LT(difference.Angle(), 1e-14);
  const Signpost& sign = read.entities[1].signpost;
  EXPECT_EQ(read.entities[1].name, scene.entities[1].name);
  EXPECT_EQ(sign.text, scene.entities[1].signpost.text);
  EXPECT_EQ(sign.anchor, scene.entities[1].signpost.anchor);
  EXPECT_EQ(sign.up, scene.entities[1].signpost.up);
  EXPECT_EQ(sign.height_m, 0.07);
  EXPECT_EQ(sign.to_map, "Desk 3");
  EXPECT_TRUE(DecodeScene(EncodeScene(Scene{}), "the library", Known()).entities.empty());
}

TEST(SceneCodec, InvalidMembersAreRejectedWithTheirLocation) {
  const nlohmann::json good = nlohmann::json::parse(EncodeScene(TestScene()));
  const auto with = [&](const char* pointer, const nlohmann::json& value) {
    nlohmann::json changed = good;
    changed[nlohmann::json::json_pointer(pointer)] = value;
    return Refusal(changed.dump());
  };
  EXPECT_EQ(Refusal(good.dump()), "");
  EXPECT_THAT(with("/docent_scene", 2), HasSubstr("newer version"));
  EXPECT_THAT(with("/entities/0/asset", "xyz"), HasSubstr("entities[0] uses the asset xyz"));
  EXPECT_THAT(with("/entities/0/kind", "lamp"), HasSubstr("neither a model nor a signpost"));
  EXPECT_THAT(with("/entities/0/animation", 0.5), HasSubstr("entities[0].animation"));
  EXPECT_THAT(with("/entities/0/map_from_model/scale", 0), HasSubstr("map_from_model.scale"));
  EXPECT_THAT(with("/entities/0/map_from_model/scale", -1), HasSubstr("map_from_model.scale"));
  EXPECT_THAT(with("/entities/0/map_from_model/rotation_xyzw", {0, 0, 0, 0}), HasSubstr("length 1"));
  EXPECT_THAT(with("/entities/0/map_from_model/translation_m", {0, 0}), HasSubstr("list of 3 numbers"));
  EXPECT_THAT(with("/entities/0/map_from_model/translation_m/1", 1e300), HasSubstr("range"));
  EXPECT_THAT(with("/entities/0/surprise", 1), HasSubstr("'surprise'"));
  EXPECT_THAT(with("/entities/0/name", "sign \"1\""), HasSubstr("name of another entity"));
  EXPECT_THAT(with("/entities/0/name", ""), HasSubstr("empty name"));
  EXPECT_THAT(with("/entities/1/up", {0, 0, 2}), HasSubstr("length 1"));
  EXPECT_THAT(with("/entities/1/height_m", 0), HasSubstr("height_m"));
  EXPECT_THAT(with("/entities/1/text", 5), HasSubstr("entities[1].text"));
  EXPECT_THAT(with("/entities/1/text", nullptr), HasSubstr("entities[1].text"));
  EXPECT_THAT(with("/entities", nlohmann::json::object()), HasSubstr("not lists"));
  EXPECT_THAT(Refusal("[1,2]"), HasSubstr("the library"));
  EXPECT_THAT(Refusal("{"), HasSubstr("not valid JSON"));
}

TEST(SceneCodec, MissingMembersAreRejected) {
  const nlohmann::json good = nlohmann::json::parse(EncodeScene(TestScene()));
  int removed = 0;
  for (std::size_t entity = 0; entity < 2; ++entity) {
    for (const auto& [name, value] : good["entities"][entity].items()) {
      nlohmann::json changed = good;
      changed["entities"][entity].erase(name);
      EXPECT_NE(Refusal(changed.dump()), "") << name;
      ++removed;
    }
  }
  EXPECT_EQ(removed, 12);
}

}  // namespace
}  // namespace docent::content

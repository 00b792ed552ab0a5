// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "content/scene_codec.h"
#include "content/warp.h"
#include "engine/base/random.h"
#include "engine/base/utf8.h"
#include "tests/support/error_of.h"

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
  sign.signpost.height = 0.07;
  sign.signpost.to_map = "Desk 3";
  sign.signpost.to_key = 18'000'000'000'000'000'000u;
  sign.locked = sign.hidden = true;
  sign.group = "Halle \"B\"";
  scene.entities.push_back(sign);
  return scene;
}

AssetLookup Known() {
  return [](const std::string& id) { return id == "abc" ? MakeTestAsset(id) : nullptr; };
}

std::string ErrorOfScene(const std::string& text) {
  return ErrorOf([&] { DecodeScene(text, "the library", Known()); });
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
  EXPECT_EQ(sign.height, 0.07);
  EXPECT_EQ(sign.to_map, "Desk 3");
  EXPECT_EQ(sign.to_key, scene.entities[1].signpost.to_key);
  EXPECT_TRUE(read.entities[1].locked && read.entities[1].hidden);
  EXPECT_FALSE(read.entities[0].locked || read.entities[0].hidden);
  EXPECT_EQ(read.entities[1].group, scene.entities[1].group);
  EXPECT_TRUE(DecodeScene(EncodeScene(Scene{}), "the library", Known()).entities.empty());
}

// One in twenty unit quaternions changes in its last bits when it is normalized again.
TEST(SceneCodec, DecodingReproducesEveryRotationToTheBit) {
  Scene scene = TestScene();
  Random random(3);
  const auto angle = [&] { return 4 * random.Uniform() - 2; };
  for (int i = 0; i < 500; ++i) {
    engine::Rotation3& rotation = scene.entities.front().model.map_from_model.rotation;
    const double x = angle(), y = angle(), z = angle();
    rotation = rotation * engine::Rotation3::Exp({x, y, z});
    const Scene decoded = DecodeScene(EncodeScene(scene), "the library", Known());
    ASSERT_EQ(decoded.entities.front().model.map_from_model.rotation.quaternion().coeffs(),
              rotation.quaternion().coeffs());
  }
}

TEST(SceneCodec, InvalidMembersAreRejectedWithTheirLocation) {
  const nlohmann::json good = nlohmann::json::parse(EncodeScene(TestScene()));
  const auto with = [&](const char* pointer, const nlohmann::json& value) {
    nlohmann::json changed = good;
    changed[nlohmann::json::json_pointer(pointer)] = value;
    return ErrorOfScene(changed.dump());
  };
  EXPECT_EQ(ErrorOfScene(good.dump()), "");
  EXPECT_THAT(with("/docent_scene", kSceneVersion + 1), HasSubstr("newer version"));
  EXPECT_THAT(with("/entities/0/asset", "xyz"), HasSubstr("entities[0] uses the asset xyz"));
  EXPECT_THAT(with("/entities/0/kind", "lamp"), HasSubstr("neither a model nor of another kind"));
  EXPECT_THAT(with("/entities/0/animation", 0.5), HasSubstr("entities[0].animation"));
  EXPECT_THAT(with("/entities/0/map_from_model/scale", 0), HasSubstr("map_from_model.scale"));
  EXPECT_THAT(with("/entities/0/map_from_model/scale", -1), HasSubstr("map_from_model.scale"));
  EXPECT_THAT(with("/entities/0/map_from_model/rotation_xyzw", {0, 0, 0, 0}), HasSubstr("length 1"));
  EXPECT_THAT(with("/entities/0/map_from_model/translation_m", {0, 0}), HasSubstr("list of 3 numbers"));
  EXPECT_THAT(with("/entities/0/map_from_model/translation_m/1", 1e300), HasSubstr("range"));
  nlohmann::json warp = {{"controls_m", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
                         {"weights", {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}},
                         {"affine", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}}};
  EXPECT_EQ(with("/entities/0/warp", warp), "");
  warp["weights"].erase(0);
  EXPECT_THAT(with("/entities/0/warp", warp), HasSubstr("entities[0].warp"));
  warp["weights"][2][0] = 1e300;
  EXPECT_THAT(with("/entities/0/warp", warp), HasSubstr("entities[0].warp.weights"));
  EXPECT_THAT(with("/entities/0/warp", nullptr), HasSubstr("entities[0].warp"));
  EXPECT_THAT(with("/entities/0/surprise", 1), HasSubstr("'surprise'"));
  EXPECT_THAT(with("/entities/0/name", "sign \"1\""), HasSubstr("name of another entity"));
  EXPECT_THAT(with("/entities/0/name", ""), HasSubstr("empty name"));
  EXPECT_THAT(with("/entities/1/up", {0, 0, 2}), HasSubstr("length 1"));
  EXPECT_THAT(with("/entities/1/height_m", 0), HasSubstr("height_m"));
  EXPECT_THAT(with("/entities/1/text", 5), HasSubstr("entities[1].text"));
  EXPECT_THAT(with("/entities/1/text", nullptr), HasSubstr("entities[1].text"));
  EXPECT_THAT(with("/entities/1/locked", 1), HasSubstr("entities[1].locked"));
  EXPECT_THAT(with("/entities/1/group", 1), HasSubstr("entities[1].group"));
  EXPECT_THAT(with("/entities/1/to_key", -1), HasSubstr("entities[1].to_key"));
  EXPECT_THAT(with("/docent_scene", 0), HasSubstr("no valid version"));
  EXPECT_THAT(with("/entities", nlohmann::json::object()), HasSubstr("not lists"));
  EXPECT_THAT(ErrorOfScene("[1,2]"), HasSubstr("the library"));
  EXPECT_THAT(ErrorOfScene("{"), HasSubstr("not valid JSON"));
}

// Mostly ordinary values, and every limit, each side of it, and what is no number.
double AnyNumber(Random* random, double typical) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const std::vector<double> odd = {
      0,     -0.0,   1e-9, 1e-6, 1e6,       1e9,        1e12,
      1e300, 5e-324, -1,   -1e6, kInfinity, -kInfinity, std::numeric_limits<double>::quiet_NaN()};
  if (random->Uniform(0, 1) < 0.97) return random->Uniform(-typical, typical);
  const double value = odd[static_cast<std::size_t>(random->Uniform(0, static_cast<double>(odd.size())))];
  return value * (random->Uniform(0, 1) < 0.5 ? 1 : 1.0000001);
}

std::string AnyText(Random* random) {
  const std::vector<std::string> parts = {"a",
                                          "\"",
                                          "\\",
                                          "\n",
                                          std::string(1, '\0'),
                                          "\x01",
                                          "é",
                                          "→",
                                          "\xE9",
                                          "\x7F",
                                          "#",
                                          "\xED\xA0\x80",
                                          " ",
                                          "-2",
                                          "\xC0",
                                          std::string(9'999, 'x')};
  std::string text = "name" + std::to_string(static_cast<int>(random->Uniform(0, 1e6)));
  while (random->Uniform(0, 1) < 0.4)
    text += parts[static_cast<std::size_t>(
        random->Uniform(0, random->Uniform(0, 1) < 0.1 ? static_cast<double>(parts.size()) : 8.0))];
  return random->Uniform(0, 1) < 0.01 ? "" : text;
}

Entity AnyEntity(Random* random) {
  const auto vector = [&](double typical) {
    return Eigen::Vector3d(AnyNumber(random, typical), AnyNumber(random, typical),
                           AnyNumber(random, typical));
  };
  Entity entity;
  entity.name = AnyText(random);
  if (random->Uniform(0, 1) < 0.5) {
    entity.kind = Entity::Kind::kModel;
    if (random->Uniform(0, 1) < 0.98) entity.model.asset = MakeTestAsset("abc");
    entity.model.animation = static_cast<int>(random->Uniform(-1.5, 2));
    if (random->Uniform(0, 1) < 0.02) entity.model.animation = std::numeric_limits<int>::max();
    entity.model.map_from_model.rotation = engine::Rotation3::Exp(vector(3));
    entity.model.map_from_model.translation = vector(100);
    entity.model.map_from_model.scale = std::abs(AnyNumber(random, 10));
  } else {
    entity.signpost.text = AnyText(random);
    entity.signpost.anchor = vector(100);
    entity.signpost.up = vector(1);
    if (random->Uniform(0, 1) < 0.98) entity.signpost.up.normalize();
    entity.signpost.height = AnyNumber(random, 10);
    entity.signpost.to_map = AnyText(random);
    entity.signpost.to_key = static_cast<std::uint64_t>(random->Uniform(0, 1e18));
    if (random->Uniform(0, 1) < 0.3) entity.signpost.translations["de-at"] = AnyText(random);
    if (random->Uniform(0, 1) < 0.02) entity.signpost.translations["DE"] = "wrong";
    if (random->Uniform(0, 1) < 0.3) entity.signpost.direction = vector(1);
    if (random->Uniform(0, 1) < 0.98 && entity.signpost.direction) entity.signpost.direction->normalize();
  }
  entity.locked = random->Uniform(0, 1) < 0.5;
  entity.hidden = random->Uniform(0, 1) < 0.5;
  if (random->Uniform(0, 1) < 0.1) entity.group = AnyText(random);
  return entity;
}

TEST(SceneCodec, EveryRandomSceneIsRefusedByTheWriterOrReadBackEqual) {
  Random random(17);
  int written = 0, refused = 0;
  for (int trial = 0; trial < 3000; ++trial) {
    Scene scene;
    const int count = static_cast<int>(random.Uniform(0, 4));
    for (int i = 0; i < count; ++i) scene.entities.push_back(AnyEntity(&random));
    const std::string problem = Validate(scene);
    if (!problem.empty()) {
      EXPECT_THROW(EncodeScene(scene), Error) << problem;
      EXPECT_EQ(problem.back(), '.') << problem;
      ++refused;
      continue;
    }
    const std::string text = EncodeScene(scene);
    ASSERT_EQ(ErrorOfScene(text), "") << text;
    const Scene read = DecodeScene(text, "the library", Known());
    ASSERT_EQ(read.entities.size(), scene.entities.size());
    for (std::size_t i = 0; i < read.entities.size(); ++i) {
      const Entity &a = scene.entities[i], &b = read.entities[i];
      EXPECT_EQ(a.name, b.name);
      EXPECT_EQ(a.signpost.text, b.signpost.text);
      EXPECT_EQ(a.signpost.translations, b.signpost.translations);
      EXPECT_EQ(a.signpost.to_map, b.signpost.to_map);
      EXPECT_EQ(PlaceOf(a), PlaceOf(b));
      EXPECT_EQ(a.model.map_from_model.scale, b.model.map_from_model.scale);
      EXPECT_EQ(a.signpost.height, b.signpost.height);
      EXPECT_EQ(a.signpost.to_key, b.signpost.to_key);
      EXPECT_EQ(a.signpost.direction, b.signpost.direction);
      EXPECT_EQ(a.locked, b.locked);
      EXPECT_EQ(a.hidden, b.hidden);
      EXPECT_EQ(a.group, b.group);
    }
    ++written;
  }
  EXPECT_GT(written, 500);
  EXPECT_GT(refused, 500);
}

TEST(SceneCodec, TheLargestScenesThatAreWrittenCanBeRead) {
  Scene scene;
  Entity model = TestScene().entities[0];
  model.model.map_from_model.translation = {-1.0 / 3e5, 123456.78901234567, -1e-300};
  const std::string digits(60, '\x01');  // The longest in JSON: six bytes each.
  for (std::size_t i = 0; i < kMaxEntities; ++i) {
    model.name = digits + std::to_string(i);
    scene.entities.push_back(model);
  }
  ASSERT_EQ(Validate(scene), "");
  EXPECT_EQ(ErrorOfScene(EncodeScene(scene)), "");
  // As many bent models as there can be, with numbers of full length.
  Warp warp;
  warp.controls.assign(kMinWarpPoints, {-1.0 / 3e5, 123456.78901234567, -1e-300});
  warp.weights = warp.controls;
  warp.affine.setConstant(-1.0 / 3e5);
  const Scene straight = scene;
  for (std::size_t i = 0; i < kMaxSceneWarpPoints / kMinWarpPoints; ++i)
    scene.entities[i].model.warp = std::make_shared<Warp>(warp);
  ASSERT_EQ(Validate(scene), "");
  EXPECT_EQ(ErrorOfScene(EncodeScene(scene)), "");
  scene.entities.back().model.warp = std::make_shared<Warp>(warp);
  EXPECT_THAT(Validate(scene), HasSubstr("at most 50000 points"));
  scene = straight;
  scene.entities.push_back(model);
  scene.entities.back().name = "one more";
  EXPECT_THAT(Validate(scene), HasSubstr("at most 50000"));
  scene.entities.clear();
  Entity sign = TestScene().entities[1];
  sign.group.clear();
  sign.signpost.direction = Eigen::Vector3d(-1.0 / 3, 2.0 / 3, -2.0 / 3);
  sign.signpost.anchor = {-1.0 / 3e5, 123456.78901234567, -1e-300};
  for (std::size_t i = 0; i < kMaxEntities; ++i) {
    sign.name = std::to_string(i);
    scene.entities.push_back(sign);
  }
  ASSERT_EQ(Validate(scene), "");
  EXPECT_EQ(ErrorOfScene(EncodeScene(scene)), "");
  scene.entities.clear();
  sign.signpost.text = std::string(kMaxTextBytes, '\x01');
  for (int i = 0; Validate(scene).empty(); ++i) {
    sign.name = std::to_string(i);
    scene.entities.push_back(sign);
  }
  EXPECT_THAT(Validate(scene), HasSubstr("names and texts"));
  scene.entities.pop_back();
  EXPECT_EQ(ErrorOfScene(EncodeScene(scene)), "");
}

TEST(Scene, TextIsUtf8WhereJsonTakesIt) {
  Random random(5);
  int good = 0;
  for (int trial = 0; trial < 200'000; ++trial) {
    std::string text;
    for (std::size_t n = random.Below(5); n > 0; --n) {
      // The bytes at the borders of each class, and any byte.
      constexpr unsigned char kBorders[] = {0x00, 0x41, 0x7F, 0x80, 0x8F, 0x90, 0x9F, 0xA0,
                                            0xBF, 0xC0, 0xC1, 0xC2, 0xDF, 0xE0, 0xE1, 0xEC,
                                            0xED, 0xEE, 0xEF, 0xF0, 0xF1, 0xF4, 0xF5, 0xFF};
      const bool any = random.Uniform() < 0.2;
      text += static_cast<char>(any ? random.Below(256) : kBorders[random.Below(std::size(kBorders))]);
    }
    bool accepted = true;
    try {
      (void)nlohmann::json(text).dump();
    } catch (const nlohmann::json::type_error&) {
      accepted = false;
    }
    ASSERT_EQ(IsUtf8(text), accepted) << nlohmann::json(std::vector<unsigned char>(text.begin(), text.end()));
    good += accepted ? 1 : 0;
  }
  EXPECT_GT(good, 40'000);
  EXPECT_LT(good, 160'000);
  EXPECT_EQ(Shortened("aé", 2), "a");
  EXPECT_EQ(Shortened("aé", 3), "aé");
}

TEST(Scene, AModelsNameComesFromItsFile) {
  EXPECT_EQ(NameFromFile("models/old fox.glb"), "old fox");
  EXPECT_EQ(NameFromFile("caf\xE9.glb"), "caf\xEF\xBF\xBD");
}

TEST(SceneCodec, MissingMembersAreRejected) {
  const nlohmann::json good = nlohmann::json::parse(EncodeScene(TestScene()));
  int removed = 0;
  for (std::size_t entity = 0; entity < 2; ++entity) {
    for (const auto& [name, value] : good["entities"][entity].items()) {
      nlohmann::json changed = good;
      changed["entities"][entity].erase(name);
      EXPECT_NE(ErrorOfScene(changed.dump()), "") << name;
      ++removed;
    }
  }
  EXPECT_EQ(removed, 19);
}

TEST(SceneCodec, ScenesOfTheFirstVersionAreRead) {
  nlohmann::json old = nlohmann::json::parse(EncodeScene(TestScene()));
  old["docent_scene"] = 1;
  EXPECT_THAT(ErrorOfScene(old.dump()), HasSubstr("that this version of Docent does not know"));
  for (nlohmann::json& entity : old["entities"]) {
    for (const char* name : {"locked", "hidden", "group", "to_key"}) entity.erase(name);
  }
  const Scene read = DecodeScene(old.dump(), "the library", Known());
  ASSERT_EQ(read.entities.size(), 2u);
  EXPECT_FALSE(read.entities[1].locked || read.entities[1].hidden);
  EXPECT_EQ(read.entities[1].group, "");
  EXPECT_EQ(read.entities[1].signpost.to_key, 0u);
  EXPECT_EQ(read.entities[1].signpost.to_map, "Desk 3");
}

TEST(SceneCodec, ScenesOfTheSecondVersionHaveNoTranslations) {
  Scene scene = TestScene();
  nlohmann::json old = nlohmann::json::parse(EncodeScene(scene));
  old["docent_scene"] = 2;
  EXPECT_EQ(EncodeScene(DecodeScene(old.dump(), "the library", Known())), EncodeScene(scene));
  scene.entities[1].signpost.translations["es"] = "Al café";
  old = nlohmann::json::parse(EncodeScene(scene));
  EXPECT_EQ(DecodeScene(old.dump(), "the library", Known()).entities[1].signpost.translations,
            scene.entities[1].signpost.translations);
  old["docent_scene"] = 2;
  EXPECT_THAT(ErrorOfScene(old.dump()), HasSubstr("'translations'"));
}

TEST(SceneCodec, TranslationsThatTheWriterRefusesAreNotRead) {
  Scene scene = TestScene();
  scene.entities[1].signpost.translations["es"] = "Al café";
  const nlohmann::json good = nlohmann::json::parse(EncodeScene(scene));
  const auto with = [&](const nlohmann::json& translations) {
    nlohmann::json changed = good;
    changed["entities"][1]["translations"] = translations;
    return ErrorOfScene(changed.dump());
  };
  EXPECT_EQ(with({{"de", "Zum Café"}}), "");
  EXPECT_THAT(with({{"DE", "Zum Café"}}), HasSubstr("tag is not valid"));
  EXPECT_THAT(with({{"", "Zum Café"}}), HasSubstr("tag is not valid"));
  EXPECT_THAT(with({{"de", ""}}), HasSubstr("'de'"));
  EXPECT_THAT(with({{"de", std::string(kMaxTextBytes + 1, 'x')}}), HasSubstr("at most 10000 bytes"));
  EXPECT_THAT(with({{"de", 5}}), HasSubstr("not a string"));
  EXPECT_THAT(with({"de", "Zum Café"}), HasSubstr("translations is not a JSON object"));
  nlohmann::json many;
  for (char a = 'a'; a < 'c'; ++a) {
    for (char b = 'a'; b < 'r'; ++b) many[std::string{a, b}] = "x";
  }
  EXPECT_THAT(with(many), HasSubstr("more than 32 languages"));
}

TEST(SceneCodec, ADamagedEntityCostsOnlyThatEntity) {
  Scene scene = TestScene();
  for (const char* name : {"second", "third", "fourth"}) {
    scene.entities.push_back(scene.entities[1]);
    scene.entities.back().name = name;
  }
  const nlohmann::json good = nlohmann::json::parse(EncodeScene(scene));
  std::vector<std::string> problems;
  const auto read = [&](const nlohmann::json& json) {
    problems.clear();
    return ReadScene(json.dump(), "the library", Known(), &problems);
  };
  EXPECT_EQ(EncodeScene(read(good)), EncodeScene(scene));
  EXPECT_TRUE(problems.empty());
  nlohmann::json bad = good;
  bad["entities"][0]["asset"] = "lost";
  bad["entities"][1]["name"] = "third";
  bad["entities"][2] = 5;
  bad["entities"][4]["height_m"] = -1;
  const Scene rest = read(bad);
  ASSERT_EQ(rest.entities.size(), 2u);
  EXPECT_EQ(rest.entities[0].name, "third");
  EXPECT_EQ(rest.entities[1].name, "entity-4") << "the second 'third'";
  ASSERT_EQ(problems.size(), 4u);
  EXPECT_THAT(problems[0], testing::AllOf(HasSubstr("the asset lost"), HasSubstr("called 'helmet'")));
  EXPECT_THAT(problems[1], HasSubstr("entities[2] is neither"));
  EXPECT_THAT(problems[2], HasSubstr("entities[3] has the name of another entity"));
  EXPECT_THAT(problems[3], HasSubstr("called 'fourth'"));
  EXPECT_EQ(Validate(rest), "");
  EXPECT_THAT(ErrorOf([&] { read("[]"); }), HasSubstr("the library"));
  bad["docent_scene"] = kSceneVersion + 1;
  EXPECT_THAT(ErrorOf([&] { read(bad); }), HasSubstr("newer version"));
}

}  // namespace
}  // namespace docent::content

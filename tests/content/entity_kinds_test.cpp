// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>
#include <nlohmann/json.hpp>

#include "content/edits.h"
#include "content/history_codec.h"
#include "content/placement.h"
#include "content/scene_codec.h"
#include "engine/base/random.h"
#include "tests/content/edit_samples.h"
#include "tests/support/error_of.h"

namespace docent::content {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

AssetLookup AnyAsset() {
  return [](const std::string& id) { return AssetNamed(id); };
}

engine::Sim3 AnyMotion(Random* random) {
  const auto vector = [&](double most) {
    return Eigen::Vector3d(random->Uniform(-most, most), random->Uniform(-most, most),
                           random->Uniform(-most, most));
  };
  return {engine::Rotation3::Exp(vector(2)), vector(5), random->Uniform(0.3, 3)};
}

TEST(EntityKinds, EachIsReadBackAsItWasWritten) {
  const Scene scene = AllKinds();
  ASSERT_EQ(Validate(scene), "");
  const std::string text = EncodeScene(scene);
  EXPECT_THAT(SceneAssetIds(text), ElementsAre("fox", "plan", "roar"));
  const Scene read = DecodeScene(text, "the library", AnyAsset());
  EXPECT_EQ(EncodeScene(read), text);
  ASSERT_EQ(read.entities.size(), 8u);
  EXPECT_EQ(read.entities[2].label.offset, scene.entities[2].label.offset);
  EXPECT_EQ(read.entities[2].label.translations, scene.entities[2].label.translations);
  EXPECT_EQ(read.entities[3].kind, Entity::Kind::kImage);
  EXPECT_EQ(read.entities[3].model.asset->id, "plan");
  EXPECT_EQ(read.entities[4].sound.caption, "The lion roars.");
  EXPECT_EQ(read.entities[4].sound.range, 1.7);
  EXPECT_EQ(read.entities[5].trail.points, scene.entities[5].trail.points);
  EXPECT_EQ(read.entities[5].trail.up, scene.entities[5].trail.up);
  EXPECT_EQ(read.entities[6].occluder.size, scene.entities[6].occluder.size);
  EXPECT_EQ(read.entities[7].occluder.outline, scene.entities[7].occluder.outline);
}

TEST(EntityKinds, AnOlderSceneHasOnlyModelsAndSignposts) {
  for (const std::size_t index : {2u, 3u, 4u, 5u, 6u, 7u}) {
    Scene scene;
    scene.entities = {AllKinds().entities[index]};
    if (Translations* const translations = TranslationsOf(&scene.entities[0])) translations->clear();
    nlohmann::json json = nlohmann::json::parse(EncodeScene(scene));
    json["docent_scene"] = 2;
    EXPECT_THAT(ErrorOf([&] { DecodeScene(json.dump(), "the library", AnyAsset()); }),
                HasSubstr("of another kind"));
  }
}

TEST(EntityKinds, MissingAndUnknownMembersAreRefused) {
  const nlohmann::json good = nlohmann::json::parse(EncodeScene(AllKinds()));
  const auto error_of = [](const nlohmann::json& json) {
    return ErrorOf([&] { DecodeScene(json.dump(), "the library", AnyAsset()); });
  };
  EXPECT_EQ(error_of(good), "");
  for (std::size_t i = 0; i < good["entities"].size(); ++i) {
    for (const auto& [name, value] : good["entities"][i].items()) {
      nlohmann::json changed = good;
      changed["entities"][i].erase(name);
      EXPECT_EQ(error_of(changed).empty(), name == "translations") << i << ' ' << name;
      changed["entities"][i][name] = nullptr;
      EXPECT_NE(error_of(changed), "") << i << ' ' << name;
    }
    nlohmann::json changed = good;
    changed["entities"][i]["surprise"] = 1;
    EXPECT_THAT(error_of(changed), HasSubstr("'surprise'"));
  }
}

TEST(EntityKinds, NumbersOutOfRangeAreRefusedByWriterAndReader) {
  const nlohmann::json good = nlohmann::json::parse(EncodeScene(AllKinds()));
  const auto expect_refused = [&](const char* pointer, const nlohmann::json& value) {
    nlohmann::json changed = good;
    changed[nlohmann::json::json_pointer(pointer)] = value;
    EXPECT_NE(ErrorOf([&] { DecodeScene(changed.dump(), "the library", AnyAsset()); }), "") << pointer;
  };
  expect_refused("/entities/2/offset_m/0", 2e6);
  expect_refused("/entities/2/text_height_m", 0);
  expect_refused("/entities/2/up", {0, 0, 2});
  expect_refused("/entities/4/range_m", -1);
  expect_refused("/entities/4/position_m", {0, 0});
  expect_refused("/entities/5/width_m", 0);
  expect_refused("/entities/5/points_m", nlohmann::json::array({{0, 0, 0}}));
  expect_refused("/entities/5/points_m", nlohmann::json(std::vector<std::vector<int>>(201, {0, 0, 0})));
  expect_refused("/entities/5/points_m/0", {0, 0});
  expect_refused("/entities/6/size/1", 0);
  expect_refused("/entities/6/size", {1, 1});
  expect_refused("/entities/6/shape", "sphere");
  expect_refused("/entities/6/shape", "polygon");
  expect_refused("/entities/6/map_from_shape/scale", 0);
  expect_refused("/entities/7/outline", nlohmann::json::array({{0, 0}, {1, 0}}));
  expect_refused("/entities/7/outline", nlohmann::json(std::vector<std::vector<int>>(65, {0, 0})));
  expect_refused("/entities/7/outline/1", {0, 0, 0});
  const auto problem_with = [](const auto& change) {
    Scene scene = AllKinds();
    change(&scene.entities);
    EXPECT_THROW(EncodeScene(scene), Error);
    return Validate(scene);
  };
  using Entities = std::vector<Entity>;
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(problem_with([](Entities* all) { (*all)[2].label.offset.x() = kNan; }),
              HasSubstr("coordinate"));
  EXPECT_THAT(problem_with([](Entities* all) { (*all)[2].label.text = "\xFF"; }), HasSubstr("not UTF-8"));
  EXPECT_THAT(problem_with([](Entities* all) { (*all)[3].model.asset = nullptr; }), HasSubstr("no image"));
  EXPECT_THAT(problem_with([](Entities* all) { (*all)[4].sound.asset = nullptr; }), HasSubstr("no sound"));
  EXPECT_THAT(problem_with([](Entities* all) { (*all)[4].sound.range = 0; }), HasSubstr("a range of 0"));
  EXPECT_THAT(problem_with([](Entities* all) { (*all)[5].trail.points.resize(1); }), HasSubstr("1 points"));
  EXPECT_THAT(problem_with([](Entities* all) {
                (*all)[5].trail.points.resize(201, {0, 0, 0});
              }),
              HasSubstr("201 points"));
  EXPECT_THAT(problem_with([](Entities* all) { (*all)[5].trail.up *= 2; }), HasSubstr("up direction"));
  EXPECT_THAT(problem_with([](Entities* all) { (*all)[6].occluder.size.x() = kNan; }), HasSubstr("a side"));
  EXPECT_THAT(problem_with([](Entities* all) {
                (*all)[7].occluder.outline = {{0, 0}, {1, 1}, {1, 0}, {0, 1.5}};
              }),
              HasSubstr("crosses itself"));
}

TEST(EntityKinds, AFileOfAnotherKindIsRefused) {
  Scene scene = AllKinds();
  auto asset = std::make_shared<Asset>();
  asset->id = "sound";
  asset->kind = AssetKind::kSound;
  asset->bytes.assign(1, 0);
  scene.entities[3].model.asset = asset;
  EXPECT_THAT(Validate(scene), HasSubstr("'plan' would have no image"));
  scene.entities[3].model.asset = AssetNamed("plan");
  scene.entities[4].sound.asset = asset;
  EXPECT_EQ(Validate(scene), "");
}

TEST(EntityKinds, AllTrailsOfASceneHaveALimit) {
  Scene scene;
  Entity trail = TrailEntity("trail");
  trail.trail.points.assign(kMaxTrailPoints, {-1.0 / 3e5, 123456.78901234567, -1e-300});
  for (std::size_t i = 0; i < kMaxSceneTrailPoints / kMaxTrailPoints; ++i) {
    trail.name = std::to_string(i);
    scene.entities.push_back(trail);
  }
  ASSERT_EQ(Validate(scene), "");
  EXPECT_EQ(DecodeScene(EncodeScene(scene), "the library", AnyAsset()).entities.size(),
            scene.entities.size());
  trail.name = "one more";
  scene.entities.push_back(trail);
  EXPECT_THAT(Validate(scene), HasSubstr("at most 20000 points"));
}

TEST(EntityKinds, TransformingAnEntityTransformsItsPose) {
  Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    for (const Entity& before : AllKinds().entities) {
      const engine::Sim3 motion = AnyMotion(&random);
      Entity after = before;
      TransformBy(motion, &after);
      const engine::Sim3 expected = motion * PoseOf(before), pose = PoseOf(after);
      EXPECT_LT((PlaceOf(after) - motion * PlaceOf(before)).norm(), 1e-9) << before.name;
      EXPECT_NEAR(pose.scale, expected.scale, 1e-9);
      if (HasModel(before) || before.kind == Entity::Kind::kTrail || before.kind == Entity::Kind::kOccluder) {
        EXPECT_LT((pose.rotation.inverse() * expected.rotation).Angle(), 1e-6) << before.name;
      }
      EXPECT_EQ(PoseProblem(after), "");
    }
  }
}

TEST(EntityKinds, AnEntityTakesThePoseThatItIsGiven) {
  Random random(4);
  for (const Entity& before : AllKinds().entities) {
    const engine::Sim3 pose = AnyMotion(&random);
    Scene scene = AllKinds();
    ApplyChange(TransformEdit(scene, before.name, pose), &scene);
    const engine::Sim3 taken = PoseOf(*scene.Find(before.name));
    EXPECT_LT((taken.translation - pose.translation).norm(), 1e-9) << before.name;
    EXPECT_NEAR(taken.scale, pose.scale, 1e-9);
    // Nothing changes where an entity gets the pose that it has.
    scene = AllKinds();
    ApplyChange(TransformEdit(scene, before.name, PoseOf(before)), &scene);
    EXPECT_LT((PlaceOf(*scene.Find(before.name)) - PlaceOf(before)).norm(), 1e-12);
  }
  // The board of a label keeps its place relative to the size of its text.
  Scene scene = AllKinds();
  engine::Sim3 larger = PoseOf(scene.entities[2]);
  larger.scale *= 2;
  ApplyChange(TransformEdit(scene, "label-1", larger), &scene);
  EXPECT_LT((scene.entities[2].label.offset - 2 * AllKinds().entities[2].label.offset).norm(), 1e-12);
}

TEST(EntityKinds, MovingMovesEveryPointOfATrail) {
  Scene scene = AllKinds();
  ApplyChange(MoveEdit(scene, "trail-1", {1, 3, 5}), &scene);
  const Trail &moved = scene.entities[5].trail, before = AllKinds().entities[5].trail;
  for (std::size_t i = 0; i < moved.points.size(); ++i)
    EXPECT_LT((moved.points[i] - before.points[i] - Eigen::Vector3d(1, 2, 5)).norm(), 1e-12);
  ApplyChange(MoveEdit(scene, "roar", {0.1, 0.2, 0.3}), &scene);
  EXPECT_EQ(scene.entities[4].sound.position, Eigen::Vector3d(0.1, 0.2, 0.3));
}

TEST(EntityKinds, ScalingKeepsTheBase) {
  for (const Entity& before : AllKinds().entities) {
    Scene scene = AllKinds();
    ApplyChange(ScaleEdit(scene, before.name, 2.5), &scene);
    const Entity& after = *scene.Find(before.name);
    EXPECT_LT((BaseInMap(after) - BaseInMap(before)).norm(), 1e-12) << before.name;
    EXPECT_NEAR(PoseOf(after).scale, 2.5 * PoseOf(before).scale, 1e-12) << before.name;
    EXPECT_THROW(
        {
          Scene copy = AllKinds();
          ApplyChange(ScaleEdit(copy, before.name, -1), &copy);
        },
        Error);
  }
}

TEST(EntityKinds, RotatingATrailTurnsItAboutItsFirstPoint) {
  Scene scene = AllKinds();
  ApplyChange(RotateEdit(scene, "trail-1", 90), &scene);
  const Trail &turned = scene.entities[5].trail, before = AllKinds().entities[5].trail;
  EXPECT_LT((turned.points[0] - before.points[0]).norm(), 1e-12);
  EXPECT_LT((turned.up - before.up).norm(), 1e-9);
  const Eigen::AngleAxisd quarter(std::acos(0.0), before.up);
  for (std::size_t i = 1; i < turned.points.size(); ++i) {
    const Eigen::Vector3d expected = before.points[0] + quarter * (before.points[i] - before.points[0]);
    EXPECT_LT((turned.points[i] - expected).norm(), 1e-9);
  }
  for (const char* name : {"sign-1", "label-1", "roar"})
    EXPECT_THAT(ErrorOf([&] { RotateEdit(scene, name, 5); }), HasSubstr("cannot be rotated")) << name;
}

TEST(EntityKinds, ATrailGrowsAndShrinksAtItsEnd) {
  Scene scene = AllKinds();
  EditHistory history;
  history.Do(AddPointEdit(scene, "trail-1", {2, 1, 2}), &scene);
  EXPECT_EQ(scene.entities[5].trail.points.size(), 4u);
  EXPECT_EQ(scene.entities[5].trail.points.back(), Eigen::Vector3d(2, 1, 2));
  history.Do(RemovePointEdit(scene, "trail-1"), &scene);
  history.Do(RemovePointEdit(scene, "trail-1"), &scene);
  EXPECT_THAT(ErrorOf([&] { RemovePointEdit(scene, "trail-1"); }), HasSubstr("cannot have fewer points"));
  EXPECT_THAT(ErrorOf([&] {
                AddPointEdit(scene, "plan", {0, 0, 0});
              }),
              HasSubstr("'plan' is an image, which has no points."));
  while (history.Undo(&scene)) {
  }
  EXPECT_EQ(EncodeScene(scene), EncodeScene(AllKinds()));
  scene.entities[5].trail.points.resize(kMaxTrailPoints, {0, 0, 0});
  EXPECT_THAT(ErrorOf([&] {
                ApplyChange(AddPointEdit(scene, "trail-1", {0, 0, 0}), &scene);
              }),
              HasSubstr("201 points"));
}

TEST(EntityKinds, LabelsAndCaptionsHaveTextsInSeveralLanguages) {
  Scene scene = AllKinds();
  ApplyChange(TextEdit(scene, "label-1", "lion"), &scene);
  ApplyChange(TextEdit(scene, "label-1", "Löwe", "de"), &scene);
  EXPECT_EQ(ShownText(scene.entities[2], "de-at"), "Löwe");
  EXPECT_EQ(ShownText(scene.entities[2], "es"), "león");
  EXPECT_EQ(ShownText(scene.entities[2], "fr"), "lion");
  EXPECT_EQ(ShownText(scene.entities[4], "de"), "Der Löwe brüllt.");
  EXPECT_EQ(ShownText(scene.entities[0], "de"), "");
  EXPECT_EQ(ErrorOf([&] { TextEdit(scene, "plan", "x"); }), "'plan' is an image, which has no text.");
  EXPECT_EQ(ErrorOf([&] { TargetEdit(scene, "label-1", "Desk", 1); }),
            "'label-1' is a label, which cannot lead to a map.");
}

TEST(EntityKinds, CopiesStandBesideTheirOriginals) {
  Scene scene = AllKinds();
  std::vector<std::string> names;
  for (const Entity& entity : scene.entities) names.push_back(entity.name);
  ApplyChange(DuplicateEdit(scene, names), &scene);
  ASSERT_EQ(scene.entities.size(), 16u);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(scene.entities[i + 8].kind, scene.entities[i].kind);
    EXPECT_GT((PlaceOf(scene.entities[i + 8]) - PlaceOf(scene.entities[i])).norm(), 0.05) << names[i];
  }
  ApplyChange(PasteEdit(scene, AllKinds().entities), &scene);
  EXPECT_EQ(scene.entities.size(), 24u);
  ApplyChange(RemoveEdit(scene, names), &scene);
  EXPECT_EQ(scene.entities.size(), 16u);
}

TEST(EntityKinds, AStoredHistoryKnowsThemAndTheirFiles) {
  Scene scene = AllKinds();
  EditHistory history;
  history.Do(RemoveEdit(scene, {"plan", "roar", "trail-1", "label-1"}), &scene);
  const std::string text = EncodeHistory(history, kMaxHistoryBytes);
  EXPECT_THAT(HistoryAssetIds(text), ElementsAre("plan", "roar"));
  EXPECT_EQ(history.Assets().size(), 2u);
  EditHistory read = DecodeHistory(text, "the library", AnyAsset());
  ASSERT_TRUE(read.Undo(&scene));
  EXPECT_EQ(EncodeScene(scene), EncodeScene(AllKinds()));
}

TEST(FlushPose, LiesOnTheSurfaceAndIsUprightOnAWall) {
  const Eigen::Vector3d up(0, -1, 0), point(1, 2, 3), viewer(1.5, 1, -1);
  const Eigen::Vector3d wall = Eigen::Vector3d(0.3, 0.2, -1).normalized();
  engine::Sim3 pose = FlushPose(point, viewer, wall, up, 2);
  EXPECT_LT((pose.rotation * Eigen::Vector3d::UnitZ() - wall).norm(), 1e-12);
  EXPECT_GT((pose.rotation * Eigen::Vector3d::UnitY()).dot(up), 0.9);
  EXPECT_NEAR((pose.rotation * Eigen::Vector3d::UnitX()).dot(up), 0, 1e-12);
  EXPECT_NEAR(pose.rotation.matrix().determinant(), 1, 1e-12);
  EXPECT_EQ(pose.translation, point);
  EXPECT_EQ(pose.scale, 2);
  pose = FlushPose(point, viewer, up, up, 1);
  EXPECT_LT((pose.rotation * Eigen::Vector3d::UnitZ() - up).norm(), 1e-12);
  EXPECT_GT((pose.rotation * Eigen::Vector3d::UnitY()).dot(point - viewer), 1)
      << "it is read from where it was placed";
  EXPECT_TRUE(FlushPose(point, point + up, up, up, 1).rotation.matrix().allFinite());
}

}  // namespace
}  // namespace docent::content

// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "content/edits.h"
#include "content/scene_codec.h"
#include "tests/support/error_of.h"

namespace docent::content {
namespace {

using ::testing::HasSubstr;

Entity ModelEntity(const std::string& name) {
  Entity entity;
  entity.name = name;
  entity.kind = Entity::Kind::kModel;
  auto asset = std::make_shared<Asset>();
  asset->id = "fox";
  entity.model.asset = std::move(asset);
  entity.model.map_from_model.translation = {1, 2, 3};
  entity.model.map_from_model.scale = 2;
  return entity;
}

Entity SignEntity(const std::string& name) {
  Entity entity;
  entity.name = name;
  entity.signpost.text = "To the \"cat\"";
  entity.signpost.to_map = "Desk 3";
  return entity;
}

Scene ThreeEntities() {
  Scene scene;
  scene.entities = {ModelEntity("helmet"), SignEntity("sign-1"), ModelEntity("old fox")};
  return scene;
}

TEST(Edits, UndoRevertsEachEditExactly) {
  std::vector<std::unique_ptr<Edit>> edits;
  edits.push_back(AddEdit(ModelEntity("fox")));
  edits.push_back(AddEdit(SignEntity("sign-2")));
  edits.push_back(MoveEdit("helmet", {7, 8, 9}));
  edits.push_back(MoveEdit("sign-1", {7, 8, 9}));
  edits.push_back(RotateEdit("old fox", 33));
  edits.push_back(ScaleEdit("helmet", 0.3));
  edits.push_back(ScaleEdit("sign-1", 0.3));
  edits.push_back(RemoveEdit("helmet"));
  edits.push_back(RemoveEdit("sign-1"));
  for (std::size_t i = 0; i < edits.size(); ++i) {
    Scene scene = ThreeEntities();
    const std::string before = EncodeScene(scene);
    edits[i]->Apply(&scene);
    EXPECT_NE(EncodeScene(scene), before) << "edit " << i;
    edits[i]->Undo(&scene);
    EXPECT_EQ(EncodeScene(scene), before) << "edit " << i;
  }
}

TEST(Edits, UndoAndRedoFollowAMovedAnchor) {
  const engine::Sim3 motion{engine::Rotation3::Exp({0, 0.1, 0}), {0.5, 0, -0.5}, 1.25};
  const auto move_all = [&](EditHistory* history, Scene* scene) {
    for (Entity& entity : scene->entities) MoveWithAnchor(motion, &entity);
    for (const char* name : {"helmet", "sign-1", "old fox", "fox"}) history->MoveWithAnchor(name, motion);
  };
  const auto same = [](const Scene& a, const Scene& b) {
    ASSERT_EQ(a.entities.size(), b.entities.size());
    for (std::size_t i = 0; i < a.entities.size(); ++i) {
      EXPECT_EQ(a.entities[i].name, b.entities[i].name);
      EXPECT_LT((PlaceOf(a.entities[i]) - PlaceOf(b.entities[i])).norm(), 1e-12) << a.entities[i].name;
      EXPECT_NEAR(a.entities[i].model.map_from_model.scale, b.entities[i].model.map_from_model.scale, 1e-12);
    }
  };
  EditHistory history;
  Scene scene = ThreeEntities();
  std::vector<Scene> moved;  // The scene after each edit, transformed by the anchor's motion.
  const auto keep = [&] {
    moved.push_back(scene);
    for (Entity& entity : moved.back().entities) MoveWithAnchor(motion, &entity);
  };
  keep();
  for (const auto make : {+[] { return AddEdit(ModelEntity("fox")); },
                          +[] {
                            return MoveEdit("helmet", {7, 8, 9});
                          },
                          +[] { return ScaleEdit("old fox", 3); }, +[] { return RemoveEdit("sign-1"); }}) {
    history.Do(make(), &scene);
    keep();
  }
  ASSERT_TRUE(history.Undo(&scene));  // So that there is an edit to redo.
  move_all(&history, &scene);
  same(scene, moved[3]);
  for (int i = 2; i >= 0; --i) {
    ASSERT_TRUE(history.Undo(&scene));
    same(scene, moved[static_cast<std::size_t>(i)]);
  }
  for (std::size_t i = 1; i < moved.size(); ++i) {
    ASSERT_TRUE(history.Redo(&scene));
    same(scene, moved[i]);
  }
}

TEST(Edits, MoveRotateAndScaleChangeThePoseAsDocumented) {
  Scene scene = ThreeEntities();
  const engine::Sim3& pose = scene.entities[0].model.map_from_model;
  MoveEdit("helmet", {4, 5, 6})->Apply(&scene);
  EXPECT_EQ(pose.translation, Eigen::Vector3d(4, 5, 6));
  ScaleEdit("helmet", 1.5)->Apply(&scene);
  EXPECT_DOUBLE_EQ(pose.scale, 3);
  // About its own y axis, counter-clockwise seen from above: z moves to x.
  scene.entities[0].model.map_from_model.rotation =
      engine::Rotation3::Exp(Eigen::Vector3d::UnitX() * std::numbers::pi / 2);
  RotateEdit("helmet", 90)->Apply(&scene);
  const Eigen::Vector3d front = pose.rotation * Eigen::Vector3d::UnitZ();
  EXPECT_LT((front - Eigen::Vector3d::UnitX()).norm(), 1e-12);
  const Eigen::Vector3d up = pose.rotation * Eigen::Vector3d::UnitY();
  EXPECT_LT((up - Eigen::Vector3d::UnitZ()).norm(), 1e-12) << "the up axis must not change";
  ScaleEdit("sign-1", 2)->Apply(&scene);
  EXPECT_DOUBLE_EQ(scene.entities[1].signpost.height_m, 0.2);
}

TEST(Edits, InvalidEditsThrowAndChangeNothing) {
  Scene scene = ThreeEntities();
  const std::string before = EncodeScene(scene);
  const auto refusal = [&](const std::unique_ptr<Edit>& edit) {
    return ErrorOf([&] { ApplyChecked(edit.get(), &scene); });
  };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(refusal(MoveEdit("cat", {0, 0, 0})), HasSubstr("no 'cat'"));
  EXPECT_THAT(refusal(MoveEdit("helmet", {0, kNan, 0})), HasSubstr("'helmet' would have a coordinate"));
  EXPECT_THAT(refusal(MoveEdit("sign-1", {0, 0, -2e6})), HasSubstr("coordinate of -2e+06"));
  EXPECT_THAT(refusal(RotateEdit("sign-1", 5)), HasSubstr("signpost"));
  EXPECT_THAT(refusal(RotateEdit("helmet", kNan)), HasSubstr("angle"));
  EXPECT_THAT(refusal(ScaleEdit("helmet", 0)), HasSubstr("scale of 0"));
  EXPECT_THAT(refusal(ScaleEdit("helmet", -1)), HasSubstr("scale of -2"));
  EXPECT_THAT(refusal(ScaleEdit("helmet", 1e9)), HasSubstr("scale of 2e+09"));
  EXPECT_THAT(refusal(ScaleEdit("sign-1", 1e-6)), HasSubstr("height of 1e-07"));
  EXPECT_THAT(refusal(RemoveEdit("cat")), HasSubstr("no 'cat'"));
  EXPECT_THAT(refusal(AddEdit(ModelEntity("helmet"))), HasSubstr("already"));
  EXPECT_THAT(refusal(AddEdit(ModelEntity(""))), HasSubstr("no name"));
  EXPECT_THAT(refusal(AddEdit(ModelEntity("caf\xE9"))), HasSubstr("not UTF-8"));
  Entity sign = SignEntity("sign-2");
  sign.signpost.text = std::string(kMaxTextBytes + 1, 'x');
  EXPECT_THAT(refusal(AddEdit(sign)), HasSubstr("10000 bytes"));
  EXPECT_EQ(EncodeScene(scene), before);
}

TEST(Edits, AnEntityStaysWhereItsAnchorWouldMoveItOutOfTheLimits) {
  Scene scene = ThreeEntities();
  const std::string before = EncodeScene(scene);
  for (const engine::Sim3& motion : {engine::Sim3{{}, {0, 2e6, 0}, 1}, engine::Sim3{{}, {0, 0, 0}, 1e12}}) {
    for (Entity& entity : scene.entities) MoveWithAnchor(motion, &entity);
    EXPECT_EQ(EncodeScene(scene), before);
  }
}

TEST(EditHistory, UndoAndRedoRestoreTheSameScenes) {
  Scene scene;
  EditHistory history;
  std::vector<std::string> states = {EncodeScene(scene)};
  const auto perform = [&](std::unique_ptr<Edit> edit) {
    history.Do(std::move(edit), &scene);
    states.push_back(EncodeScene(scene));
  };
  perform(AddEdit(ModelEntity("fox")));
  perform(AddEdit(SignEntity("sign")));
  perform(MoveEdit("fox", {0.25, -1, 0}));
  perform(RotateEdit("fox", -45));
  perform(ScaleEdit("sign", 2));
  perform(RemoveEdit("fox"));
  EXPECT_FALSE(history.Redo(&scene));
  for (std::size_t i = states.size() - 1; i > 0; --i) {
    ASSERT_TRUE(history.Undo(&scene));
    EXPECT_EQ(EncodeScene(scene), states[i - 1]);
  }
  EXPECT_FALSE(history.Undo(&scene));
  for (std::size_t i = 1; i < states.size(); ++i) {
    ASSERT_TRUE(history.Redo(&scene));
    EXPECT_EQ(EncodeScene(scene), states[i]);
  }
  EXPECT_FALSE(history.Redo(&scene));
  history.Undo(&scene);
  history.Do(MoveEdit("fox", {0, 0, 0}), &scene);
  EXPECT_FALSE(history.Redo(&scene)) << "a new edit discards undone edits";
}

TEST(EditHistory, AnEditThatThrowsIsNotStored) {
  Scene scene;
  EditHistory history;
  EXPECT_THROW(history.Do(RemoveEdit("fox"), &scene), Error);
  EXPECT_THROW(history.Do(AddEdit(ModelEntity("")), &scene), Error);
  EXPECT_FALSE(history.Undo(&scene));
  EXPECT_TRUE(scene.entities.empty());
}

}  // namespace
}  // namespace docent::content

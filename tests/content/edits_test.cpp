// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "content/edit_script.h"
#include "content/edits.h"
#include "content/scene_codec.h"
#include "engine/base/error.h"

namespace docent::content {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

Entity ModelEntity(const std::string& name) {
  Entity entity;
  entity.name = name;
  entity.kind = Entity::Kind::kModel;
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

template <typename Action>
std::string Refusal(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(Edits, UndoRevertsEachEditExactly) {
  std::vector<std::unique_ptr<Edit>> edits;
  edits.push_back(PlaceModelEdit(ModelEntity("fox"), "fox.glb", {10, 20}));
  edits.push_back(AddSignpostEdit(SignEntity("sign-2"), {10, 20}));
  edits.push_back(MoveEdit("helmet", {7, 8, 9}));
  edits.push_back(MoveEdit("sign-1", {7, 8, 9}));
  edits.push_back(RotateEdit("old fox", 33));
  edits.push_back(ScaleEdit("helmet", 0.3));
  edits.push_back(ScaleEdit("sign-1", 0.3));
  edits.push_back(RemoveEdit("helmet"));
  edits.push_back(RemoveEdit("sign-1"));
  for (const auto& edit : edits) {
    Scene scene = ThreeEntities();
    const std::string before = EncodeScene(scene);
    edit->Apply(&scene);
    EXPECT_NE(EncodeScene(scene), before) << edit->Text();
    edit->Undo(&scene);
    EXPECT_EQ(EncodeScene(scene), before) << edit->Text();
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
  for (const auto make : {+[] {
                            return PlaceModelEdit(ModelEntity("fox"), "fox.glb", {10, 20});
                          },
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
  EXPECT_THAT(Refusal([&] { MoveEdit("cat", {0, 0, 0})->Apply(&scene); }), HasSubstr("no 'cat'"));
  EXPECT_THAT(Refusal([&] { RotateEdit("sign-1", 5)->Apply(&scene); }), HasSubstr("signpost"));
  EXPECT_THAT(Refusal([&] { ScaleEdit("helmet", 0)->Apply(&scene); }), HasSubstr("scaled"));
  EXPECT_THAT(Refusal([&] { ScaleEdit("helmet", 1e9)->Apply(&scene); }), HasSubstr("scaled"));
  EXPECT_THAT(Refusal([&] { RemoveEdit("cat")->Apply(&scene); }), HasSubstr("no 'cat'"));
  EXPECT_THAT(Refusal([&] { PlaceModelEdit(ModelEntity("helmet"), "f.glb", {})->Apply(&scene); }),
              HasSubstr("already"));
  EXPECT_EQ(EncodeScene(scene), before);
}

TEST(EditHistory, UndoAndRedoRestoreTheSameScenes) {
  Scene scene;
  EditHistory history;
  std::vector<std::string> states = {EncodeScene(scene)};
  const auto perform = [&](std::unique_ptr<Edit> edit) {
    history.Do(std::move(edit), &scene);
    states.push_back(EncodeScene(scene));
  };
  perform(PlaceModelEdit(ModelEntity("fox"), "a fox.glb", {3.5, 4}, 0.5, 90));
  perform(AddSignpostEdit(SignEntity("sign"), {1, 2}));
  perform(MoveEdit("fox", {0.25, -1, 0}));
  perform(RotateEdit("fox", -45));
  perform(ScaleEdit("sign", 2));
  perform(RemoveEdit("fox"));
  EXPECT_FALSE(history.can_redo());
  EXPECT_THAT(history.Lines(),
              ElementsAre("place \"a fox.glb\" at pixel 3.5 4 scale 0.5 yaw 90",
                          "signpost \"To the \\\"cat\\\"\" at pixel 1 2 to \"Desk 3\"", "move fox 0.25 -1 0",
                          "rotate fox -45", "scale sign 2", "remove fox"));
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
  EXPECT_FALSE(history.can_redo()) << "a new edit discards undone edits";
}

TEST(EditHistory, AnEditThatThrowsIsNotStored) {
  Scene scene;
  EditHistory history;
  EXPECT_THROW(history.Do(RemoveEdit("fox"), &scene), Error);
  EXPECT_FALSE(history.can_undo());
}

TEST(EditScript, QuotingInvertsSplitting) {
  EXPECT_THAT(SplitWords("12.5 map new \"Desk 3\"  # a comment"),
              ElementsAre("12.5", "map", "new", "Desk 3"));
  EXPECT_THAT(SplitWords("  a\tb # c"), ElementsAre("a", "b"));
  EXPECT_THAT(SplitWords("\"a # b\" \"\""), ElementsAre("a # b", ""));
  EXPECT_TRUE(SplitWords("# nothing").empty());
  EXPECT_THAT(Refusal([] { SplitWords("say \"hello"); }), HasSubstr("not closed"));
  for (const char* word :
       {"plain", "two words", "", "a\"b", "back\\slash", "line\nbreak", "#1", "\t", "ende\\"}) {
    EXPECT_THAT(SplitWords(QuoteWord(word)), ElementsAre(word));
    EXPECT_THAT(SplitWords(QuoteText(word)), ElementsAre(word));
  }
}

TEST(EditScript, NumbersReadBackToTheSameBits) {
  for (const double number : {0.1, -1e-300, 12345.678901234567, 0.0, 1.0 / 3}) {
    EXPECT_EQ(ParseNumber(NumberText(number), "x"), number);
  }
  for (const char* word : {"", "1x", "one", "nan", "inf", "1e999", "0x10", " 1"}) {
    EXPECT_THROW(ParseNumber(word, "The number"), Error) << word;
  }
}

TEST(EditScript, LinesOfEditsReadBackToTheSameEdits) {
  for (const char* line :
       {"move \"old fox\" 0.1 -2 3e-05", "rotate helmet 33.5", "scale sign-1 0.25", "remove helmet"}) {
    const std::vector<std::string> words = SplitWords(line);
    const std::unique_ptr<Edit> edit = ParseEdit(words);
    ASSERT_NE(edit, nullptr) << line;
    EXPECT_EQ(edit->Text(), line);
    Scene scene = ThreeEntities();
    edit->Apply(&scene);
    EXPECT_NE(EncodeScene(scene), EncodeScene(ThreeEntities()));
  }
  const auto parse = [](const char* line) { return ParseEdit(SplitWords(line)); };
  EXPECT_EQ(parse("undo"), nullptr);
  EXPECT_EQ(parse(""), nullptr);
  EXPECT_THAT(Refusal([&] { parse("move helmet 1 2"); }), HasSubstr("move NAME X Y Z"));
  EXPECT_THAT(Refusal([&] { parse("scale helmet big"); }), HasSubstr("'big' is not a number"));
  EXPECT_THAT(Refusal([&] { parse("remove"); }), HasSubstr("remove NAME"));
}

}  // namespace
}  // namespace docent::content

// SPDX-License-Identifier: Apache-2.0
#include "content/edits.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "content/placement.h"
#include "content/scene_codec.h"
#include "content/warp.h"
#include "tests/content/edit_samples.h"
#include "tests/support/error_of.h"

namespace docent::content {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::string> NamesOf(const Scene& scene) {
  std::vector<std::string> names;
  for (const Entity& entity : scene.entities) names.push_back(entity.name);
  return names;
}

const Correspondence kCorners[] = {
    {{0, 0, 0}, {0, 0, 0}}, {{1, 0, 0}, {0.5, 0.1, 0}}, {{0, 1, 0}, {0, 0.5, 0}}, {{0, 0, 1}, {0, 0, 0.5}}};

// One of each kind of edit, for the scene of edit_samples.h.
std::vector<SceneChange> OneOfEach(const Scene& scene) {
  return {AddEdit(scene, ModelEntity("fox")),
          AddEdit(scene, SignEntity("sign-2")),
          PasteEdit(scene, {ModelEntity("helmet"), SignEntity("sign-1")}),
          DuplicateEdit(scene, {"sign-1", "helmet"}),
          MoveEdit(scene, "helmet", {7, 8, 9}),
          MoveEdit(scene, "sign-1", {7, 8, 9}),
          RotateEdit(scene, "old fox", 33),
          ScaleEdit(scene, "helmet", 0.3),
          ScaleEdit(scene, "sign-1", 0.3),
          TransformEdit(scene, "helmet", {engine::Rotation3::Exp({1, 2, 3}), {4, 5, 6}, 0.7}),
          TransformEdit(scene, "sign-1", {engine::Rotation3::Exp({1, 2, 3}), {4, 5, 6}, 0.7}),
          RenameEdit(scene, "helmet", "hat"),
          TextEdit(scene, "sign-1", "elsewhere"),
          TargetEdit(scene, "sign-1", "Desk 4", 9),
          DirectionEdit(scene, "sign-1", Eigen::Vector3d(1, 2, 3)),
          AlignEdit(scene, "helmet", kCorners, nullptr),
          BendEdit(scene, "old fox", kCorners),
          FlagEdit(scene, {"helmet", "sign-1"}, EntityFlag::kLocked, true),
          FlagEdit(scene, {"old fox"}, EntityFlag::kHidden, true),
          GroupEdit(scene, {"old fox", "helmet"}, "animals"),
          RemoveEdit(scene, {"helmet"}),
          RemoveEdit(scene, {"sign-1", "helmet"}),
          RemoveEdit(scene, {"old fox", "helmet", "sign-1"})};
}

TEST(Edits, UndoRevertsEachEditExactly) {
  for (const SceneChange& edit : OneOfEach(ThreeEntities())) {
    Scene scene = ThreeEntities();
    const std::string before = EncodeScene(scene);
    ApplyChange(edit, &scene);
    const std::string after = EncodeScene(scene);
    EXPECT_NE(after, before) << edit.label;
    ApplyChange(Reversed(edit), &scene);
    EXPECT_EQ(EncodeScene(scene), before) << edit.label;
    ApplyChange(edit, &scene);
    EXPECT_EQ(EncodeScene(scene), after) << edit.label;
    EXPECT_FALSE(edit.label.empty());
  }
}

TEST(Edits, UndoAndRedoFollowAMovedAnchor) {
  const engine::Sim3 motion{engine::Rotation3::Exp({0, 0.1, 0}), {0.5, 0, -0.5}, 1.25};
  const auto move_all = [&](EditHistory* history, Scene* scene) {
    for (Entity& entity : scene->entities) {
      MoveWithAnchor(motion, &entity);
      history->MoveWithAnchor(entity.name, motion);
    }
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
  for (const auto make : {+[](const Scene& s) { return AddEdit(s, ModelEntity("fox")); },
                          +[](const Scene& s) {
                            return MoveEdit(s, "helmet", {7, 8, 9});
                          },
                          +[](const Scene& s) { return RenameEdit(s, "old fox", "young fox"); },
                          +[](const Scene& s) { return ScaleEdit(s, "young fox", 3); },
                          +[](const Scene& s) { return RenameEdit(s, "young fox", "fox 3"); }}) {
    history.Do(make(scene), &scene);
    keep();
  }
  // So that there are edits to redo, one of them under another name.
  ASSERT_TRUE(history.Undo(&scene));
  ASSERT_TRUE(history.Undo(&scene));
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

// A fox was removed, and then another one added under the same name.
EditHistory HistoryOfTwoFoxes(Scene* scene) {
  EditHistory history;
  Entity second = ModelEntity("fox");
  second.model.map_from_model.translation = {10, 0, 0};
  history.Do(AddEdit(*scene, ModelEntity("fox")), scene);
  history.Do(RemoveEdit(*scene, {"fox"}), scene);
  history.Do(AddEdit(*scene, second), scene);
  return history;
}

TEST(EditHistory, AbsentEntitiesOfOneNameAreMovedApart) {
  Scene scene;
  EditHistory history = HistoryOfTwoFoxes(&scene);
  history.Do(RemoveEdit(scene, {"fox"}), &scene);
  const std::vector<AbsentEntity> absent = history.Absent(5);
  ASSERT_EQ(absent.size(), 2u);
  EXPECT_EQ(history.Absent(1).size(), 1u);
  EXPECT_EQ(PlaceOf(absent[0].entity).x(), 10) << "undo restores it first";
  history.MoveWithAnchor(absent[0], {{}, {0, 0, 5}, 1});
  ASSERT_TRUE(history.Undo(&scene));
  EXPECT_EQ(PlaceOf(scene.entities[0]), Eigen::Vector3d(10, 0, 5));
  ASSERT_TRUE(history.Undo(&scene));
  ASSERT_TRUE(history.Undo(&scene));
  EXPECT_EQ(PlaceOf(scene.entities[0]), PlaceOf(ModelEntity("fox")));
  // Both are absent again: the second one may be added by redo.
  ASSERT_TRUE(history.Undo(&scene));
  EXPECT_EQ(history.Absent(5).size(), 2u);
  EXPECT_TRUE(history.Absent(5)[1].undone);
}

TEST(EditHistory, OnlyTheEntityThatHasTheNameNowFollowsItsAnchor) {
  Scene scene;
  EditHistory history = HistoryOfTwoFoxes(&scene);
  history.MoveWithAnchor("fox", {{}, {0, 0, 5}, 1});
  ASSERT_TRUE(history.Undo(&scene));
  ASSERT_TRUE(history.Undo(&scene));
  EXPECT_EQ(PlaceOf(*scene.Find("fox")), Eigen::Vector3d(1, 2, 3));
  ASSERT_TRUE(history.Redo(&scene));
  ASSERT_TRUE(history.Redo(&scene));
  EXPECT_EQ(PlaceOf(*scene.Find("fox")), Eigen::Vector3d(10, 0, 5));
}

TEST(Edits, MoveRotateAndScaleChangeThePoseAsDocumented) {
  Scene scene = ThreeEntities();
  const engine::Sim3& pose = scene.entities[0].model.map_from_model;
  const auto apply = [&](const SceneChange& change) {
    // The entities are replaced in place, so that `pose` stays valid.
    for (const EntityChange& entity : change.entities) scene.entities[entity.index] = *entity.after;
  };
  apply(MoveEdit(scene, "helmet", {4, 5, 6}));
  EXPECT_EQ(pose.translation, Eigen::Vector3d(4, 5, 6));
  apply(ScaleEdit(scene, "helmet", 1.5));
  EXPECT_DOUBLE_EQ(pose.scale, 3);
  // About its own y axis, counter-clockwise seen from above: z moves to x.
  scene.entities[0].model.map_from_model.rotation =
      engine::Rotation3::Exp(Eigen::Vector3d::UnitX() * std::numbers::pi / 2);
  apply(RotateEdit(scene, "helmet", 90));
  const Eigen::Vector3d front = pose.rotation * Eigen::Vector3d::UnitZ();
  EXPECT_LT((front - Eigen::Vector3d::UnitX()).norm(), 1e-12);
  const Eigen::Vector3d up = pose.rotation * Eigen::Vector3d::UnitY();
  EXPECT_LT((up - Eigen::Vector3d::UnitZ()).norm(), 1e-12) << "the up axis must not change";
  apply(ScaleEdit(scene, "sign-1", 2));
  EXPECT_DOUBLE_EQ(scene.entities[1].signpost.height, 0.2);
  const engine::Sim3 wanted{engine::Rotation3::Exp({0.1, 0.2, 0.3}), {-1, 0, 1}, 0.4};
  apply(TransformEdit(scene, "helmet", wanted));
  EXPECT_EQ(pose.translation, wanted.translation);
  EXPECT_EQ(pose.scale, 0.4);
  EXPECT_LT((pose.rotation.inverse() * wanted.rotation).Angle(), 1e-12);
  apply(TransformEdit(scene, "sign-1", wanted));
  EXPECT_EQ(scene.entities[1].signpost.anchor, wanted.translation);
  EXPECT_EQ(scene.entities[1].signpost.height, 0.4);
  EXPECT_EQ(scene.entities[1].signpost.up, SignEntity("").signpost.up);
}

TEST(Edits, TheBaseOfAModelStaysWhereItIsWhenItIsScaledOrRotated) {
  Scene scene = ThreeEntities();
  scene.entities[0].model.asset = AssetWithBox("box");
  scene.entities[0].model.map_from_model.rotation = engine::Rotation3::Exp({0.3, -0.4, 0.5});
  const Eigen::Vector3d base = BaseInMap(scene.entities[0]);
  EXPECT_GT((base - PlaceOf(scene.entities[0])).norm(), 1);
  for (const SceneChange& change : {ScaleEdit(scene, "helmet", 7), RotateEdit(scene, "helmet", 123)}) {
    const Entity& after = *change.entities[0].after;
    EXPECT_LT((BaseInMap(after) - base).norm(), 1e-12) << change.label;
    EXPECT_GT((PlaceOf(after) - PlaceOf(scene.entities[0])).norm(), 0.1) << change.label;
  }
}

TEST(Edits, ABentModelIsAlignedByItsBentShapeAndUnbentAgain) {
  Scene scene = ThreeEntities();
  const std::string before = EncodeScene(scene);
  ApplyChange(BendEdit(scene, "helmet", kCorners), &scene);
  const Entity bent = scene.entities[0];
  const auto drawn = [](const Entity& entity, const Eigen::Vector3d& x) {
    return Eigen::Vector3d(entity.model.map_from_model * (*entity.model.warp)(x));
  };
  for (const Correspondence& pair : kCorners)
    EXPECT_LT((drawn(bent, pair.in_model) - pair.in_map).norm(), 1e-9);
  const engine::Sim3 motion{engine::Rotation3::Exp({0.1, 0.2, 0.3}), {1, 1, 1}, 3};
  std::vector<Correspondence> moved;
  for (const Correspondence& pair : kCorners)
    moved.push_back({pair.in_model, motion * drawn(bent, pair.in_model)});
  Alignment alignment;
  ApplyChange(AlignEdit(scene, "helmet", moved, &alignment), &scene);
  for (const double residual : alignment.residuals) EXPECT_LT(residual, 1e-9);
  for (const Correspondence& pair : moved)
    EXPECT_LT((drawn(scene.entities[0], pair.in_model) - pair.in_map).norm(), 1e-9);
  const Scene read =
      DecodeScene(EncodeScene(scene), "test", [](const std::string& id) { return AssetNamed(id); });
  EXPECT_EQ(read.entities[0].model.warp->controls, scene.entities[0].model.warp->controls);
  EXPECT_EQ(read.entities[0].model.warp->weights, scene.entities[0].model.warp->weights);
  EXPECT_EQ(read.entities[0].model.warp->affine, scene.entities[0].model.warp->affine);
  ApplyChange(AlignEdit(scene, "helmet", kCorners, nullptr), &scene);
  ApplyChange(UnbendEdit(scene, "helmet"), &scene);
  EXPECT_EQ(scene.entities[0].model.warp, nullptr);
  EXPECT_THAT(ErrorOf([&] { UnbendEdit(scene, "helmet"); }), HasSubstr("is not bent"));
  EXPECT_THAT(ErrorOf([&] { BendEdit(scene, "sign-1", kCorners); }), HasSubstr("is a signpost"));
  EXPECT_THAT(ErrorOf([&] { AlignEdit(scene, "helmet", {}, nullptr); }), HasSubstr("At least three"));
  EXPECT_NE(EncodeScene(scene), before);
}

TEST(Edits, CopiesHaveFreeNamesAndStandBesideTheirOriginals) {
  Scene scene = ThreeEntities();
  scene.entities[0].model.asset = AssetWithBox("box");
  scene.entities[0].locked = true;
  scene.entities[1].hidden = true;
  ApplyChange(DuplicateEdit(scene, {"helmet", "sign-1"}), &scene);
  EXPECT_THAT(NamesOf(scene), ElementsAre("helmet", "sign-1", "old fox", "helmet-2", "sign-2"));
  EXPECT_FALSE(scene.entities[3].locked);
  EXPECT_FALSE(scene.entities[4].hidden);
  // 10 % more than the width of the model, 2 m at a scale of 2.
  EXPECT_NEAR((PlaceOf(scene.entities[3]) - PlaceOf(scene.entities[0])).norm(), 4.4, 1e-6);
  EXPECT_NEAR((PlaceOf(scene.entities[4]) - PlaceOf(scene.entities[1])).norm(), 0.11, 1e-6);
  ApplyChange(DuplicateEdit(scene, {"helmet-2"}), &scene);
  EXPECT_EQ(scene.entities.back().name, "helmet-3");
  ApplyChange(PasteEdit(scene, {ModelEntity("helmet"), ModelEntity("lion"), ModelEntity("lion")}), &scene);
  EXPECT_EQ(scene.entities[6].name, "helmet-4");
  EXPECT_EQ(scene.entities[7].name, "lion");
  EXPECT_EQ(scene.entities[8].name, "lion-2");
  EXPECT_EQ(PlaceOf(scene.entities[7]), Eigen::Vector3d(1, 2, 3));
}

TEST(Edits, ALockedEntityRefusesEveryChangeButUnlocking) {
  Scene scene = ThreeEntities();
  for (Entity& entity : scene.entities) entity.locked = true;
  const std::string before = EncodeScene(scene);
  using Make = SceneChange (*)(const Scene&);
  const std::vector<Make> edits = {
      [](const Scene& s) {
        return MoveEdit(s, "helmet", {0, 0, 0});
      },
      [](const Scene& s) { return RotateEdit(s, "helmet", 1); },
      [](const Scene& s) { return ScaleEdit(s, "helmet", 2); },
      [](const Scene& s) { return TransformEdit(s, "helmet", {}); },
      [](const Scene& s) { return RenameEdit(s, "helmet", "hat"); },
      [](const Scene& s) { return TextEdit(s, "sign-1", "x"); },
      [](const Scene& s) { return TargetEdit(s, "sign-1", "", 0); },
      [](const Scene& s) { return DirectionEdit(s, "sign-1", Eigen::Vector3d(1, 2, 3)); },
      [](const Scene& s) { return FlagEdit(s, {"helmet"}, EntityFlag::kHidden, true); },
      [](const Scene& s) { return GroupEdit(s, {"helmet"}, "g"); },
      [](const Scene& s) { return RemoveEdit(s, {"helmet"}); }};
  for (const Make& make : edits)
    EXPECT_THAT(ErrorOf([&] { make(scene); }), HasSubstr("is locked; unlock it to change it."));
  EXPECT_EQ(EncodeScene(scene), before);
  ApplyChange(FlagEdit(scene, {"helmet", "sign-1", "old fox"}, EntityFlag::kLocked, false), &scene);
  for (const Make& make : edits) {
    Scene copy = scene;
    EXPECT_EQ(ErrorOf([&] { ApplyChange(make(scene), &copy); }), "");
    EXPECT_NE(EncodeScene(copy), EncodeScene(scene));
  }
}

TEST(Edits, InvalidEditsThrowAndChangeNothing) {
  Scene scene = ThreeEntities();
  const std::string before = EncodeScene(scene);
  const auto refusal = [&](const auto& make) { return ErrorOf([&] { ApplyChange(make(), &scene); }); };
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  const auto move = [&](const char* name, const Eigen::Vector3d& to) {
    return refusal([&] { return MoveEdit(scene, name, to); });
  };
  const auto scale = [&](const char* name, double factor) {
    return refusal([&] { return ScaleEdit(scene, name, factor); });
  };
  EXPECT_THAT(move("cat", {0, 0, 0}), HasSubstr("no 'cat'"));
  EXPECT_THAT(move("helmet", {0, kNan, 0}), HasSubstr("'helmet' would have a coordinate"));
  EXPECT_THAT(move("sign-1", {0, 0, -2e6}), HasSubstr("coordinate of -2e+06"));
  EXPECT_THAT(refusal([&] { return RotateEdit(scene, "sign-1", 5); }), HasSubstr("signpost"));
  EXPECT_THAT(refusal([&] { return RotateEdit(scene, "helmet", kNan); }), HasSubstr("angle"));
  EXPECT_THAT(scale("helmet", 0), HasSubstr("scale of 0"));
  EXPECT_THAT(scale("helmet", -1), HasSubstr("scale of -2"));
  EXPECT_THAT(scale("helmet", 1e9), HasSubstr("scale of 2e+09"));
  EXPECT_THAT(scale("sign-1", 1e-6), HasSubstr("height of 1e-07"));
  EXPECT_THAT(refusal([&] {
                return TransformEdit(scene, "helmet", {{}, {0, 0, 0}, kNan});
              }),
              HasSubstr("scale of nan"));
  EXPECT_THAT(refusal([&] { return RenameEdit(scene, "helmet", "old fox"); }), HasSubstr("already"));
  EXPECT_THAT(refusal([&] { return RenameEdit(scene, "helmet", ""); }), HasSubstr("no name"));
  EXPECT_THAT(refusal([&] { return TextEdit(scene, "helmet", "x"); }), HasSubstr("is a model"));
  EXPECT_THAT(refusal([&] { return TargetEdit(scene, "helmet", "x", 1); }), HasSubstr("is a model"));
  EXPECT_THAT(refusal([&] { return RemoveEdit(scene, {"cat"}); }), HasSubstr("no 'cat'"));
  EXPECT_THAT(refusal([&] { return RemoveEdit(scene, {"helmet", "helmet"}); }), HasSubstr("named twice"));
  EXPECT_THAT(refusal([&] { return RemoveEdit(scene, {}); }), HasSubstr("No object is named"));
  EXPECT_THAT(refusal([&] { return FlagEdit(scene, {"helmet"}, EntityFlag::kLocked, false); }),
              HasSubstr("'helmet' is not locked."));
  EXPECT_THAT(refusal([&] { return GroupEdit(scene, {"helmet", "sign-1"}, ""); }), HasSubstr("in no group"));
  const auto add = [&](const Entity& entity) { return refusal([&] { return AddEdit(scene, entity); }); };
  EXPECT_THAT(add(ModelEntity("helmet")), HasSubstr("already"));
  EXPECT_THAT(add(ModelEntity("")), HasSubstr("no name"));
  EXPECT_THAT(add(ModelEntity("caf\xE9")), HasSubstr("not UTF-8"));
  Entity sign = SignEntity("sign-2");
  sign.signpost.text = std::string(kMaxTextBytes + 1, 'x');
  EXPECT_THAT(add(sign), HasSubstr("10000 bytes"));
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
  const auto perform = [&](SceneChange edit) {
    history.Do(std::move(edit), &scene);
    states.push_back(EncodeScene(scene));
  };
  perform(AddEdit(scene, ModelEntity("fox")));
  perform(AddEdit(scene, SignEntity("sign")));
  perform(MoveEdit(scene, "fox", {0.25, -1, 0}));
  perform(RotateEdit(scene, "fox", -45));
  perform(ScaleEdit(scene, "sign", 2));
  perform(DuplicateEdit(scene, {"fox", "sign"}));
  perform(GroupEdit(scene, {"fox", "sign-2"}, "two"));
  perform(RemoveEdit(scene, {"fox", "fox-2"}));
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
  history.Do(MoveEdit(scene, "fox", {0, 0, 0}), &scene);
  EXPECT_FALSE(history.Redo(&scene)) << "a new edit discards undone edits";
}

TEST(EditHistory, UndoAndRedoRestoreNoTargetThatIsGone) {
  Scene scene = ThreeEntities();  // sign-1 leads to the map with the key 7.
  EditHistory history;
  history.Do(TargetEdit(scene, "sign-1", "Hall", 9), &scene);
  history.Do(TargetEdit(scene, "sign-1", "Room", 4), &scene);
  history.Do(RemoveEdit(scene, {"sign-1", "helmet"}), &scene);
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(history.Undo(&scene));
  const auto lead_nowhere = [](std::uint64_t from_key) {
    return [from_key](Signpost* signpost) {
      if (signpost->to_key != from_key) return false;
      LeadNowhere(signpost);
      return true;
    };
  };
  EXPECT_TRUE(history.RetargetSignposts(lead_nowhere(7)));
  EXPECT_TRUE(history.RetargetSignposts(lead_nowhere(4)));
  EXPECT_FALSE(history.RetargetSignposts(lead_nowhere(4))) << "no state leads there any more";
  const auto target = [&] { return scene.Find("sign-1")->signpost.to_map; };
  EXPECT_EQ(target(), "Hall");
  ASSERT_TRUE(history.Undo(&scene));
  EXPECT_EQ(target(), "");
  ASSERT_TRUE(history.Redo(&scene));
  EXPECT_EQ(target(), "Hall");
  ASSERT_TRUE(history.Redo(&scene));
  EXPECT_EQ(target(), "");
  ASSERT_TRUE(history.Redo(&scene));
  ASSERT_TRUE(history.Undo(&scene));
  EXPECT_EQ(target(), "") << "as it was removed";
}

TEST(EditHistory, UndoHasNoLimitInASession) {
  constexpr int kChanges = 5000;
  Scene scene;
  EditHistory history;
  history.Do(AddEdit(scene, SignEntity("sign")), &scene);
  const Eigen::Vector3d begin = PlaceOf(*scene.Find("sign"));
  for (int i = 1; i <= kChanges; ++i)
    history.Do(MoveEdit(scene, "sign", begin + Eigen::Vector3d(0.001 * i, 0, 0)), &scene);
  for (int i = 0; i < kChanges; ++i) ASSERT_TRUE(history.Undo(&scene)) << i;
  EXPECT_EQ(PlaceOf(*scene.Find("sign")), begin);
  EXPECT_TRUE(history.Undo(&scene)) << "that it was placed";
  EXPECT_FALSE(history.Undo(&scene));
}

TEST(EditHistory, AnEditThatThrowsIsNotStored) {
  Scene scene;
  EditHistory history;
  EXPECT_THROW(history.Do(AddEdit(scene, ModelEntity("")), &scene), Error);
  EXPECT_FALSE(history.Undo(&scene));
  EXPECT_TRUE(scene.entities.empty());
}

TEST(EditHistory, UndoIsRefusedWhereOthersChangedTheSceneMeanwhile) {
  Scene scene = ThreeEntities();
  EditHistory history;
  history.Do(MoveEdit(scene, "helmet", {0, 0, 0}), &scene);
  Scene without = scene;
  without.entities.erase(without.entities.begin());
  EXPECT_THAT(ErrorOf([&] { history.Undo(&without); }), HasSubstr("no 'helmet'"));
  EXPECT_EQ(without.entities.size(), 2u);
  ASSERT_TRUE(history.Undo(&scene)) << "a refused undo stays to be undone";
  history = {};
  history.Do(RemoveEdit(scene, {"sign-1"}), &scene);
  scene.entities.push_back(SignEntity("sign-1"));
  EXPECT_THAT(ErrorOf([&] { history.Undo(&scene); }), HasSubstr("two 'sign-1'"));
  // Entities that were added or removed before it do not matter.
  scene.entities.pop_back();
  scene.entities.erase(scene.entities.begin());
  ASSERT_TRUE(history.Undo(&scene));
  EXPECT_THAT(NamesOf(scene), ElementsAre("old fox", "sign-1"));
}

TEST(Edits, CopiesOfAGroupAreAGroupOfTheirOwn) {
  const auto in_group = [](Entity entity, const std::string& group) {
    entity.group = group;
    return entity;
  };
  const auto groups_of = [](const Scene& scene) {
    std::vector<std::string> groups;
    for (const Entity& entity : scene.entities) groups.push_back(entity.group);
    return groups;
  };
  Scene scene;
  scene.entities = {in_group(ModelEntity("helmet"), "group-1"), in_group(SignEntity("sign-1"), "group-1"),
                    ModelEntity("fox")};
  ApplyChange(DuplicateEdit(scene, {"helmet", "sign-1", "fox"}), &scene);
  EXPECT_THAT(groups_of(scene), ElementsAre("group-1", "group-1", "", "group-2", "group-2", ""));
  // Entities of another map, where the same names of groups are used.
  ApplyChange(
      PasteEdit(scene, {in_group(ModelEntity("owl"), "group-2"), in_group(SignEntity("owl's"), "group-2"),
                        in_group(ModelEntity("lion"), "group-1"), in_group(ModelEntity("hat"), "hats")}),
      &scene);
  const std::vector<std::string> groups = groups_of(scene);
  EXPECT_THAT(std::vector<std::string>(groups.begin() + 6, groups.end()),
              ElementsAre("group-3", "group-3", "group-4", "hats"));
}

TEST(Edits, ATextGetsVariantsByLanguage) {
  Scene scene = ThreeEntities();
  const auto perform = [&](const char* text, const char* language) {
    ApplyChange(TextEdit(scene, "sign-1", text, language), &scene);
  };
  perform("Zur Katze", "de-AT");
  perform("Al gato", "es");
  perform("To the lion", "");
  const auto sign = [&] { return scene.entities[1].signpost; };
  EXPECT_EQ(sign().text, "To the lion");
  EXPECT_EQ(sign().translations, (Translations{{"de-at", "Zur Katze"}, {"es", "Al gato"}}));
  perform("", "es");
  EXPECT_EQ(sign().translations.count("es"), 0u);
  EXPECT_EQ(ErrorOf([&] { perform("", "es"); }), "'sign-1' has no text in 'es'.");
  EXPECT_EQ(ErrorOf([&] { perform("x", "no tag"); }), "'no tag' is not a language tag.");
}

}  // namespace
}  // namespace docent::content

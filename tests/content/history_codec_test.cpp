// SPDX-License-Identifier: Apache-2.0
#include "content/history_codec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "content/edits.h"
#include "content/scene_codec.h"
#include "tests/content/edit_samples.h"
#include "tests/support/error_of.h"

namespace docent::content {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

AssetLookup AllAssets() {
  return [](const std::string& id) { return AssetNamed(id); };
}

// A scene, its history with two undone changes, and the scenes on the way.
struct Edited {
  Scene scene = ThreeEntities();
  EditHistory history;
  std::vector<std::string> states;  // From before the first change to after the last one.
};

Edited SomeEdits() {
  Edited edited;
  Scene& scene = edited.scene;
  edited.states.push_back(EncodeScene(scene));
  const auto perform = [&](SceneChange change) {
    edited.history.Do(std::move(change), &scene);
    edited.states.push_back(EncodeScene(scene));
  };
  Entity lion = ModelEntity("lion \"1\"");
  lion.model.asset = AssetNamed("lion");
  perform(AddEdit(scene, lion));
  perform(MoveEdit(scene, "helmet", {1.0 / 3, -2e-17, 12345.678901234567}));
  perform(RemoveEdit(scene, {"sign-1", "old fox"}));
  perform(RenameEdit(scene, "helmet", "Helm, größer"));
  perform(FlagEdit(scene, {"lion \"1\""}, EntityFlag::kHidden, true));
  EXPECT_TRUE(edited.history.Undo(&scene));
  EXPECT_TRUE(edited.history.Undo(&scene));
  return edited;
}

TEST(HistoryCodec, ADecodedHistoryUndoesAndRedoesLikeTheOriginal) {
  Edited edited = SomeEdits();
  const std::string text = EncodeHistory(edited.history, kMaxHistoryBytes);
  EXPECT_THAT(HistoryAssetIds(text), ElementsAre("fox", "lion"));
  EditHistory read = DecodeHistory(text, "the library", AllAssets());
  EXPECT_EQ(EncodeHistory(read, kMaxHistoryBytes), text);
  for (int i = 2; i >= 0; --i) {
    ASSERT_TRUE(read.Undo(&edited.scene));
    EXPECT_EQ(EncodeScene(edited.scene), edited.states[static_cast<std::size_t>(i)]);
  }
  EXPECT_FALSE(read.Undo(&edited.scene));
  for (std::size_t i = 1; i < edited.states.size(); ++i) {
    ASSERT_TRUE(read.Redo(&edited.scene));
    EXPECT_EQ(EncodeScene(edited.scene), edited.states[i]);
  }
  EXPECT_FALSE(read.Redo(&edited.scene));
}

TEST(HistoryCodec, TheOldestChangesAreLeftOutWhenTheLimitIsExceeded) {
  const Edited edited = SomeEdits();
  const std::size_t all = EncodeHistory(edited.history, kMaxHistoryBytes).size();
  std::size_t most_done = 3, kinds = 0;
  for (std::size_t limit = all + 200; limit-- > 0;) {
    const std::string text = EncodeHistory(edited.history, limit);
    ASSERT_LE(text.size(), limit);
    const EditHistory read = DecodeHistory(text, "the library", AllAssets());
    ASSERT_LE(read.done().size(), most_done);
    if (read.done().size() < most_done) ++kinds;
    most_done = read.done().size();
    // Those that are left are the newest.
    Scene scene = edited.scene;
    EditHistory copy = read;
    for (std::size_t i = 0; i < read.done().size(); ++i) {
      ASSERT_TRUE(copy.Undo(&scene));
      ASSERT_EQ(EncodeScene(scene), edited.states[2 - i]);
    }
    scene = edited.scene;
    copy = read;
    for (std::size_t i = 0; i < read.undone().size(); ++i) {
      ASSERT_TRUE(copy.Redo(&scene));
      ASSERT_EQ(EncodeScene(scene), edited.states[4 + i]);
    }
  }
  EXPECT_EQ(kinds, 3u) << "each number of changes occurs";
  EXPECT_EQ(EncodeHistory(EditHistory(), kMaxHistoryBytes), "");
  EXPECT_TRUE(DecodeHistory("", "the library", AllAssets()).done().empty());
}

TEST(HistoryCodec, AMissingAssetCostsTheChangesThatNeedItAndTheOlderOnes) {
  Edited edited = SomeEdits();
  const std::string text = EncodeHistory(edited.history, kMaxHistoryBytes);
  const EditHistory read = DecodeHistory(
      text, "the library", [](const std::string& id) { return id == "fox" ? AssetNamed(id) : nullptr; });
  ASSERT_EQ(read.done().size(), 2u);
  EXPECT_EQ(read.done()[0].label, "move 'helmet'");
  ASSERT_EQ(read.undone().size(), 1u);
  EXPECT_EQ(read.undone()[0].label, "rename 'helmet'");
}

TEST(HistoryCodec, DamagedTextsAreRefused) {
  const nlohmann::json good = nlohmann::json::parse(EncodeHistory(SomeEdits().history, kMaxHistoryBytes));
  const auto refusal = [](const std::string& text) {
    return ErrorOf([&] { DecodeHistory(text, "the library", AllAssets()); });
  };
  const auto with = [&](const char* pointer, const nlohmann::json& value) {
    nlohmann::json changed = good;
    changed[nlohmann::json::json_pointer(pointer)] = value;
    return refusal(changed.dump());
  };
  EXPECT_EQ(refusal(good.dump()), "");
  EXPECT_THAT(refusal("{"), HasSubstr("not valid JSON"));
  EXPECT_THAT(with("/docent_history", 99), HasSubstr("newer version"));
  EXPECT_THAT(with("/docent_history", "x"), HasSubstr("no valid version"));
  EXPECT_THAT(with("/done", 1), HasSubstr("no list 'done'"));
  EXPECT_THAT(with("/surprise", 1), HasSubstr("'surprise'"));
  EXPECT_THAT(with("/done/0/label", 1), HasSubstr("done[0] has no valid label"));
  EXPECT_THAT(with("/done/0/changes/0/index", -1), HasSubstr("done[0].changes[0] has no valid index"));
  EXPECT_THAT(with("/done/0/changes/0/index", 1e18), HasSubstr("no valid index"));
  EXPECT_THAT(with("/done/1/changes/0/after/map_from_model/scale", 0),
              HasSubstr("done[1].changes[0].after.map_from_model.scale"));
  EXPECT_THAT(with("/done/0/changes/0/after", nullptr), HasSubstr("changes nothing"));
  EXPECT_THAT(with("/done/1/changes/0/before", {{"kind", "lamp"}}), HasSubstr("neither a model"));
}

}  // namespace
}  // namespace docent::content

// SPDX-License-Identifier: Apache-2.0
// The parts of the author's window that need no screen: recent files, the file dialog, and what was done in
// words.
#include <gmock/gmock.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "app/command_line/command_words.h"
#include "app/command_line/file_dialog.h"
#include "app/command_line/recent_files.h"
#include "app/files/text_file.h"
#include "content/assimp_loader.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(RecentFiles, AreRememberedWithTheLastOneFirst) {
  const TemporaryFolder folder;
  const std::string fox = folder.Write("fox.glb", std::string("x")).string();
  const std::string owl = folder.Write("owl.glb", std::string("x")).string();
  const std::filesystem::path place = folder / "state/docent/recent-models";
  {
    RecentFiles files(place);
    EXPECT_THAT(files.files(), IsEmpty());
    files.Add(fox);
    files.Add(owl);
    files.Add(fox);
    EXPECT_THAT(files.files(), ElementsAre(fox, owl));
  }
  EXPECT_THAT(RecentFiles(place).files(), ElementsAre(fox, owl));
  std::filesystem::remove(fox);
  EXPECT_THAT(RecentFiles(place).files(), ElementsAre(owl)) << "files that are gone are left out";
}

TEST(RecentFiles, AreLimitedAndNeedNoPlace) {
  const TemporaryFolder folder;
  RecentFiles files({});
  for (int i = 0; i < 40; ++i) files.Add(folder / ("model" + std::to_string(i) + ".glb"));
  EXPECT_EQ(files.files().size(), 12u);
  EXPECT_EQ(files.files().front(), (folder / "model39.glb").string());
  // What stands in the file is not trusted.
  const auto place = folder.Write("list", std::string("relative.glb\n\n/no/such/file.glb\n"));
  EXPECT_THAT(RecentFiles(place).files(), IsEmpty());
}

TEST(ModelFiles, AreKnownByTheirEnding) {
  const TemporaryFolder folder;
  for (const char* name : {"b.glb", "a.OBJ", "notes.txt", "c.stl"}) folder.Write(name, std::string("x"));
  EXPECT_THAT(ModelFilesIn(folder / ""), ElementsAre("a.OBJ", "b.glb", "c.stl"));
  EXPECT_THAT(ModelFilesIn(folder / "nowhere"), IsEmpty());
}

TEST(ModelFiles, AreAllThatCanBePlaced) {
  for (const std::string ending : {".glb", ".gltf", ".obj", ".ply", ".stl", ".fbx", ".dae", ".3ds", ".off"}) {
    EXPECT_TRUE(ending.starts_with(".gl") || content::IsAssimpFormat("model" + ending)) << ending;
    EXPECT_TRUE(IsModelFile("model" + ending)) << ending;
    EXPECT_THAT(ModelFilePatterns() + " ", HasSubstr("*" + ending + " "));
  }
}

TEST(CommandWords, SayWhatWasDone) {
  EXPECT_EQ(DoneText(PlaceModel{"models/red fox.glb", {1, 2}, std::nullopt, 0}), "Placed red fox.glb.");
  EXPECT_EQ(DoneText(RemoveEntities{{"fox"}}), "Removed fox.");
  EXPECT_EQ(DoneText(RemoveEntities{{"fox", "owl"}}), "Removed 2 objects.");
  EXPECT_EQ(DoneText(SetEntityFlag{{"fox"}, content::EntityFlag::kLocked, false}), "Unlocked fox.");
  EXPECT_EQ(DoneText(SetEntityFlag{{"fox"}, content::EntityFlag::kHidden, true}), "Hid fox.");
  EXPECT_EQ(DoneText(SetSignpostTarget{"sign-1", ""}), "sign-1 leads nowhere now.");
  EXPECT_EQ(DoneText(SetSignpostDirection{"sign-1", std::nullopt, true}),
            "The arrow of sign-1 points where the camera looks.");
  EXPECT_EQ(DoneText(SetSignpostDirection{"sign-1"}), "sign-1 has no arrow now.");
}

TEST(CommandWords, KnowWhatCanBeUndone) {
  EXPECT_TRUE(CanBeUndone(PlaceSignpost{"Hello", {1, 2}, ""}));
  EXPECT_TRUE(CanBeUndone(RenameEntity{"fox", "vixen"}));
  EXPECT_FALSE(CanBeUndone(Undo{}));
  EXPECT_FALSE(CanBeUndone(Save{}));
  EXPECT_FALSE(CanBeUndone(RemoveMap{"Hall"}));
  EXPECT_FALSE(CanBeUndone(JoinMap{"Hall"}));
}

}  // namespace
}  // namespace docent::app

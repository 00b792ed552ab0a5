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
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using ::testing::ElementsAre;
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

// A program called zenity in a folder of its own, which is searched first.
class FileDialogProgram : public ::testing::Test {
 protected:
  void SetUp() override { path_ = std::getenv("PATH") != nullptr ? std::getenv("PATH") : ""; }
  void TearDown() override { setenv("PATH", path_.c_str(), 1); }
  void Install(const std::string& script) {
    const auto program = folder_.Write("zenity", "#!/bin/sh\n" + script);
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    setenv("PATH", (program.parent_path().string() + ":" + path_).c_str(), 1);
  }
  // Polls until the dialog is closed, at most ten seconds.
  static std::optional<std::filesystem::path> Await(FileDialog* dialog) {
    std::optional<std::filesystem::path> chosen;
    for (int i = 0; i < 1000 && dialog->is_open(); ++i) {
      chosen = dialog->Poll();
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return chosen;
  }

  const TemporaryFolder folder_;
  std::string path_;
};

TEST_F(FileDialogProgram, GivesTheChosenFileWithoutWaitingForIt) {
  Install("sleep 0.3\necho \"/models/red fox.glb\"\n");
  EXPECT_TRUE(FileDialog::IsAvailable());
  FileDialog dialog;
  ASSERT_TRUE(dialog.Open("Choose a model", "*.glb"));
  EXPECT_FALSE(dialog.Poll()) << "it is still open";
  EXPECT_TRUE(dialog.is_open());
  EXPECT_EQ(Await(&dialog), "/models/red fox.glb");
  EXPECT_FALSE(dialog.is_open());
  ASSERT_TRUE(dialog.Open("Again", "*.glb"));
  EXPECT_EQ(Await(&dialog), "/models/red fox.glb");
}

TEST_F(FileDialogProgram, GivesNothingWhenItIsCancelled) {
  Install("echo /models/fox.glb\nexit 1\n");
  FileDialog dialog;
  ASSERT_TRUE(dialog.Open("Choose a model", "*.glb"));
  EXPECT_FALSE(Await(&dialog));
  EXPECT_FALSE(dialog.is_open());
}

TEST_F(FileDialogProgram, IsClosedWithTheWindow) {
  Install("exec sleep 60\n");
  const auto begin = std::chrono::steady_clock::now();
  {
    FileDialog dialog;
    ASSERT_TRUE(dialog.Open("Choose a model", "*.glb"));
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));
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

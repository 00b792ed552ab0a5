// SPDX-License-Identifier: Apache-2.0
// The author's window of the real program, used by keys and clicks on a virtual screen.
#include <gmock/gmock.h>

#include <chrono>
#include <cstdlib>
#include <functional>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "app/demo/exhibit_model.h"
#include "app/files/text_file.h"
#include "app/session/library_scene.h"
#include "content/scene.h"
#include "maps/library/library.h"
#include "tests/end_to_end/run_docent.h"
#include "tests/end_to_end/screen_reader.h"
#include "tests/support/must_run.h"
#include "tests/support/virtual_screen.h"
#include "tests/support/wait_until.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;

// An author at a window of 1280 x 800: the image lies in the left 960 units, 960 x 720.
class AuthorAtWindow : public ::testing::Test {
 protected:
  static constexpr int kWidth = 1280, kHeight = 800;

  void SetUp() override {
    if (!screen_.works()) SKIP_OR_FAIL("Xvfb is not installed");
    if (!HasXdotool()) SKIP_OR_FAIL("xdotool is not installed");
    // The model is among the recent files, and so it is the one to place.
    const std::vector<std::uint8_t> glb = MakeExhibitGlb();
    folder_.Write("exhibit.glb", {glb.begin(), glb.end()});
    std::filesystem::create_directories(folder_ / "docent");
    folder_.Write("docent/recent-models", (folder_ / "exhibit.glb").string() + "\n");
    setenv("XDG_STATE_HOME", (folder_ / "").parent_path().c_str(), 1);
  }
  void TearDown() override {
    unsetenv("XDG_STATE_HOME");
    if (child_ > 0) {
      kill(child_, SIGKILL);
      waitpid(child_, nullptr, 0);
    }
  }

  void Start(const std::string& script, const std::string& autosave) {
    folder_.Write("script.txt", script);
    child_ = StartDocent(
        {"author", "--library", library(), "--camera", "sim:room,fps=15", "--pace", "eager", "--until", "8",
         "--script", (folder_ / "script.txt").string(), "--record-script",
         (folder_ / "recorded.txt").string(), "--autosave", autosave, "--output", (folder_ / "run").string()},
        (folder_ / "out").string(), (folder_ / "err").string());
    ASSERT_TRUE(Wait(FocusWindow)) << ReadAll(folder_ / "err");
  }
  // Waits for the last image, which stays, so that what can be placed does not depend on when a key arrives.
  // The map has depth then. The file has its final name at the end of the run.
  void WaitForLastImage() const {
    const auto events = [this] { return ReadAll(folder_ / "run" / "events.csv.part"); };
    const auto has_come = [&] { return events().find("The images have ended") != std::string::npos; };
    ASSERT_TRUE(Wait(has_come, std::chrono::minutes(10))) << ReadAll(folder_ / "err");
    ASSERT_THAT(events(), HasSubstr("started Room"));
  }
  // No longer than the program runs.
  bool Wait(const std::function<bool()>& is_so,
            std::chrono::milliseconds longest = std::chrono::minutes(2)) const {
    return WaitWhileRunning([this] { return IsRunning(); }, is_so, longest);
  }
  std::string library() { return (folder_ / "room.docent").string(); }
  static void Do(const std::string& xdotool) {
    EXPECT_EQ(std::system(("xdotool " + xdotool + " > /dev/null").c_str()), 0) << xdotool;
  }
  static void Press(const std::string& key) {
    Do("search --name Docent windowfocus sleep 0.2 key --delay 150 " + key + " sleep 0.2");
  }
  // A key that closes the window, so that its release reaches no window any more.
  static void PressLast(const std::string& key) {
    const int ignored = std::system(
        ("xdotool search --name Docent windowfocus sleep 0.2 keydown " + key + " > /dev/null 2>&1").c_str());
    static_cast<void>(ignored);
  }
  static void Click(int x, int y) {
    Do("mousemove " + std::to_string(x) + " " + std::to_string(y) +
       " sleep 0.3 mousedown 1 sleep 0.2 mouseup 1 "
       "sleep 0.3");
  }
  // With the tool for selecting, the panel shows what is selected below this heading.
  bool HasSelection() const {
    const cv::Rect panel(960, 0, kWidth - 960, kHeight);
    const auto heading = reader_.Find("Selected", panel, 4);
    return heading && heading->y < 700 && !reader_.Find("Click an object to select it.", panel);
  }
  bool AsksWhetherToSave() const {
    return reader_.Find("Save and quit", {0, 0, kWidth, kHeight}).has_value();
  }
  // Asks to quit, and waits for the question that follows.
  void AskToQuit() {
    Press("ctrl+q");
    EXPECT_TRUE(Wait([this] { return AsksWhetherToSave() || !IsRunning(); }));
    EXPECT_TRUE(IsRunning()) << "it asks first";
  }
  bool IsRunning() const {
    siginfo_t ended{};
    waitid(P_PID, static_cast<id_t>(child_), &ended, WEXITED | WNOHANG | WNOWAIT);
    return ended.si_pid == 0;
  }
  // Waits for the end.
  std::optional<int> ExitStatus() {
    if (!Wait([this] { return !IsRunning(); })) return std::nullopt;
    int status = 0;
    waitpid(std::exchange(child_, -1), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  const TemporaryFolder folder_;
  VirtualScreen screen_{std::to_string(kWidth) + "x" + std::to_string(kHeight), folder_.path().string()};
  const ScreenReader reader_{folder_.path()};
  pid_t child_ = -1;
};

TEST_F(AuthorAtWindow, PlacesSelectsAndRemovesWithUndoAndSavesAtTheEnd) {
  ASSERT_NO_FATAL_FAILURE(Start("0.1 map new Room\n", "0"));
  ASSERT_NO_FATAL_FAILURE(WaitForLastImage());
  Press("2");
  Click(480, 520);
  Press("Escape");
  EXPECT_TRUE(Wait([this] { return HasSelection(); })) << "what was placed is selected";
  Press("ctrl+d");
  Press("Delete");
  Press("ctrl+z");
  Press("Escape");
  Press("q");
  EXPECT_TRUE(IsRunning()) << "neither Escape nor q quits";
  AskToQuit();
  Press("Escape");
  EXPECT_TRUE(Wait([this] { return !AsksWhetherToSave(); }));
  EXPECT_TRUE(IsRunning());
  AskToQuit();
  PressLast("Return");
  EXPECT_EQ(ExitStatus(), 0) << ReadAll(folder_ / "err");
  const std::string recorded = ReadAll(folder_ / "recorded.txt");
  const auto placed = recorded.find("exhibit.glb"), duplicated = recorded.find("duplicate \"exhibit"),
             removed = recorded.find("remove \"exhibit"), undone = recorded.find("undo");
  ASSERT_NE(undone, std::string::npos) << recorded;
  EXPECT_EQ(recorded.rfind("exhibit.glb"), placed) << recorded;
  EXPECT_LT(placed, duplicated) << recorded;
  EXPECT_LT(duplicated, removed) << recorded;
  EXPECT_LT(removed, undone) << recorded;
  const maps::Library stored = maps::Library::Open(library(), maps::Access::kReadOnly);
  const std::vector<maps::MapInfo> listed = stored.List();
  ASSERT_EQ(listed.size(), 1u);
  AssetCache assets;
  const content::Scene scene = SceneFromRecord(stored.LoadScene(listed[0].key), listed[0].name, &assets);
  EXPECT_EQ(scene.entities.size(), 2u) << "what was removed is there again";
}

TEST_F(AuthorAtWindow, PlacesWithTheKeyboardAlone) {
  ASSERT_NO_FATAL_FAILURE(Start("0.1 map new Room\n", "0"));
  ASSERT_NO_FATAL_FAILURE(WaitForLastImage());
  Press("2");
  Press("Return");
  for (int i = 0; i < 5; ++i) Press("shift+Left");
  for (int i = 0; i < 4; ++i) Press("ctrl+Up");
  Press("Return");
  AskToQuit();
  PressLast("Return");
  EXPECT_EQ(ExitStatus(), 0) << ReadAll(folder_ / "err");
  const std::string recorded = ReadAll(folder_ / "recorded.txt");
  std::vector<Eigen::Vector2d> pixels;
  const std::string before = "exhibit.glb at pixel ";
  for (std::size_t at = 0; (at = recorded.find(before, at)) != std::string::npos;) {
    std::istringstream numbers(recorded.substr(at += before.size()));
    numbers >> pixels.emplace_back().x() >> pixels.back().y();
  }
  ASSERT_EQ(pixels.size(), 2u) << recorded;
  // The image is drawn one and a half times as large: five steps of twelve units, four of one unit.
  const Eigen::Vector2d moved = pixels[1] - pixels[0];
  EXPECT_NEAR(moved.x(), -5 * 12 / 1.5, 0.7) << recorded;
  EXPECT_NEAR(moved.y(), -4 / 1.5, 0.7) << recorded;
}

TEST_F(AuthorAtWindow, CanQuitWithoutSaving) {
  ASSERT_NO_FATAL_FAILURE(Start("0.1 map new Room\n", "0"));
  ASSERT_NO_FATAL_FAILURE(WaitForLastImage());
  AskToQuit();
  Press("Right");  // To the second answer.
  PressLast("Return");
  EXPECT_EQ(ExitStatus(), 0) << ReadAll(folder_ / "err");
  EXPECT_TRUE(maps::Library::Open(library(), maps::Access::kReadOnly).List().empty());
}

}  // namespace
}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
// The window of a tour of the real program, used by keys on a virtual screen.
#include <gmock/gmock.h>
#include <signal.h>

#include <chrono>
#include <cstdlib>
#include <functional>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "app/files/text_file.h"
#include "maps/library/library.h"
#include "tests/end_to_end/run_docent.h"
#include "tests/support/must_run.h"
#include "tests/support/virtual_screen.h"
#include "tests/support/wait_until.h"

namespace docent::app {
namespace {

// The images of an hour, so that a program that ends meanwhile does so because it was told to.
constexpr const char* kHour = "sim:room,rest=3600,rest-at=1";

class VisitorAtWindow : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!screen_.works()) SKIP_OR_FAIL("Xvfb is not installed");
    if (!HasXdotool()) SKIP_OR_FAIL("xdotool is not installed");
    maps::Library library =
        maps::Library::Open(folder_ / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    for (const char* name : {"Lions", "Masks"})
      library.Save({library.NewKey(), name, maps::Policy::kOpen, nullptr, nullptr});
    library.ChangeTours([](std::vector<maps::Tour>* tours) { tours->push_back({"All", {1, 2}, "", 0}); });
  }
  void TearDown() override {
    if (child_ > 0) {
      kill(child_, SIGKILL);
      waitpid(child_, nullptr, 0);
    }
  }
  static void Xdotool(const std::string& command) {
    EXPECT_EQ(std::system(("xdotool " + command + " > /dev/null").c_str()), 0) << command;
  }
  static void PressKeys(const std::string& keys) {
    Xdotool("search --name Docent windowfocus sleep 0.2 key --delay 300 " + keys + " sleep 0.3");
  }

  // At most two minutes, and no longer than the program runs. Returns whether it is so.
  bool Wait(const std::function<bool()>& is_so) const {
    return WaitWhileRunning([this] { return IsRunning(); }, is_so);
  }
  void AwaitWindow() const { ASSERT_TRUE(Wait(FocusWindow)) << ReadAll(folder_ / "errors"); }
  bool IsRunning() const {
    siginfo_t ended{};
    waitid(P_PID, static_cast<id_t>(child_), &ended, WEXITED | WNOHANG | WNOWAIT);
    return ended.si_pid == 0;
  }
  // Waits for the end; empty if the program still runs.
  std::optional<int> ExitStatus() {
    if (!Wait([this] { return !IsRunning(); })) return std::nullopt;
    int status = -1;
    waitpid(std::exchange(child_, -1), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  const TemporaryFolder folder_;
  VirtualScreen screen_{"1280x800"};
  pid_t child_ = -1;
};

TEST_F(VisitorAtWindow, SkipsStopsAndIsLedBackByKeys) {
  child_ = StartDocent({"tour", "--library", (folder_ / "l.docent").string(), "--camera", kHour, "--tour",
                        "All", "--output", (folder_ / "out").string()},
                       (folder_ / "output").string(), (folder_ / "errors").string());
  ASSERT_NO_FATAL_FAILURE(AwaitWindow());
  PressKeys("l b n b n n n");
  // The key's release reaches no window any more.
  const int ignored =
      std::system("xdotool search --name Docent windowfocus sleep 0.2 keydown ctrl+q > /dev/null 2>&1");
  static_cast<void>(ignored);
  EXPECT_EQ(ExitStatus(), 0) << ReadAll(folder_ / "errors");
  std::istringstream lines(ReadAll(folder_ / "out/events.csv"));
  std::vector<std::string> events;
  for (std::string line; std::getline(lines, line);) {
    const std::string event = line.substr(line.find(',') + 1);
    if (event.starts_with("tour,") || event.starts_with("command,")) events.push_back(event);
  }
  // The first B and the last N can do nothing.
  EXPECT_THAT(events, ::testing::ElementsAre(
                          "command,tour skip", "tour,\"skipped 'Lions', stop 1 of 2\"", "command,tour back",
                          "tour,\"going back to 'Lions', stop 1 of 2\"", "command,tour skip",
                          "tour,\"going on to 'Masks', stop 2 of 2\"", "command,tour skip",
                          "tour,\"skipped 'Masks', stop 2 of 2\"", "tour,finished; 0 of 2 stops seen"));
}

TEST_F(VisitorAtWindow, IsAnsweredBeforeTheNextImage) {
  // An image every eighty seconds, as of a machine that is busy for as long with each.
  child_ = StartDocent(
      {"tour", "--library", (folder_ / "l.docent").string(), "--camera", std::string(kHour) + ",fps=0.0125",
       "--tour", "All", "--pace", "realtime", "--output", (folder_ / "out").string()},
      (folder_ / "output").string(), (folder_ / "errors").string());
  ASSERT_NO_FATAL_FAILURE(AwaitWindow());
  const auto count = [this](const std::string& part) {
    std::istringstream lines(ReadAll(folder_ / "out/events.csv.part"));
    int found = 0;
    for (std::string line; std::getline(lines, line);) found += line.find(part) != std::string::npos;
    return found;
  };
  PressKeys("n");
  // The first image is shown.
  ASSERT_TRUE(Wait([&] { return count("command,tour") == 1; })) << ReadAll(folder_ / "errors");
  const auto begin = std::chrono::steady_clock::now();
  PressKeys("b n");
  EXPECT_TRUE(Wait([&] { return count("command,tour") == 3; })) << ReadAll(folder_ / "errors");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(50));
  EXPECT_EQ(count("command,tour skip"), 2);
  EXPECT_EQ(count("skipped 'Lions'"), 1);
  EXPECT_EQ(count("going back to 'Lions'"), 1);
}

// The process that shows the window of a kiosk; -1 if there is none.
pid_t WorkerOf(pid_t kiosk) {
  std::istringstream children(
      ReadAll("/proc/" + std::to_string(kiosk) + "/task/" + std::to_string(kiosk) + "/children"));
  pid_t child = -1;
  children >> child;
  return child;
}

TEST_F(VisitorAtWindow, AKioskEndsByItsCodeOnlyAndStartsAgainAfterACrash) {
  folder_.Write("code", "4711\n");
  child_ = StartDocent({"tour", "--library", (folder_ / "l.docent").string(), "--camera", kHour, "--tour",
                        "All", "--kiosk", (folder_ / "code").string(), "--pace", "realtime"},
                       (folder_ / "output").string(), (folder_ / "errors").string());
  ASSERT_NO_FATAL_FAILURE(AwaitWindow());
  const pid_t worker = WorkerOf(child_);
  ASSERT_GT(worker, 0) << ReadAll(folder_ / "errors");
  PressKeys("ctrl+q Escape q F11 0 4 7 1 2");
  ASSERT_EQ(WorkerOf(child_), worker) << "it has ended: " << ReadAll(folder_ / "errors");
  kill(worker, SIGKILL);
  const auto has_begun_again = [&] {
    const pid_t now = WorkerOf(child_);
    return now > 0 && now != worker;
  };
  ASSERT_TRUE(Wait(has_begun_again)) << ReadAll(folder_ / "errors");
  EXPECT_THAT(ReadAll(folder_ / "errors"), ::testing::HasSubstr("it begins again in 1 s"));
  ASSERT_NO_FATAL_FAILURE(AwaitWindow());
  PressKeys("4 7 1");
  // The key's release reaches no window any more.
  const int ignored =
      std::system("xdotool search --name Docent windowfocus sleep 0.2 keydown 1 sleep 0.3 > /dev/null 2>&1");
  static_cast<void>(ignored);
  EXPECT_EQ(ExitStatus(), 0) << ReadAll(folder_ / "errors");
}

}  // namespace
}  // namespace docent::app

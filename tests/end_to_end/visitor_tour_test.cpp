// SPDX-License-Identifier: Apache-2.0
// Visitors who go through a simulated museum with the window of the real program: with one button, with the
// keyboard alone, and by what is spoken. They act when they see or hear that it is time.
#include <gmock/gmock.h>
#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <iostream>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "app/files/text_file.h"
#include "tests/end_to_end/five_stops.h"
#include "tests/end_to_end/run_docent.h"
#include "tests/end_to_end/screen_reader.h"
#include "tests/support/must_run.h"
#include "tests/support/virtual_screen.h"
#include "tests/support/wait_until.h"

namespace docent::app {
namespace {

using ::testing::AnyOf;
using ::testing::Contains;
using ::testing::ElementsAreArray;
using ::testing::HasSubstr;

// For so long the visitor rests at the fourth stop with the lens covered. The recording is played faster
// meanwhile.
constexpr double kRest_s = 125;

class VisitorOfFiveStops : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!screen_.works()) SKIP_OR_FAIL("Xvfb is not installed");
    if (!HasXdotool()) SKIP_OR_FAIL("xdotool is not installed");
    stops_.emplace();
    const TrueMuseum& museum = stops_->mapped().museum();
    rest_at_s_ = museum.Begin("visit0") + 0.7 * (museum.End("visit0") - museum.Begin("visit0"));
    walk_ =
        stops_->mapped().spec() + ",rest=" + FormatNumber(kRest_s) + ",rest-at=" + FormatNumber(rest_at_s_);
  }
  void TearDown() override {
    if (child_ > 0) {
      kill(child_, SIGKILL);
      waitpid(child_, nullptr, 0);
    }
  }

  // Starts the tour in a window and waits until it takes keys.
  void Begin(std::vector<std::string> more = {}) {
    std::vector<std::string> arguments = {"tour",
                                          "--library",
                                          stops_->mapped().library(),
                                          "--camera",
                                          "sim:" + walk_,
                                          "--from",
                                          FormatNumber(stops_->from_s()),
                                          "--until",
                                          FormatNumber(stops_->until_s() + kRest_s),
                                          "--pace",
                                          "lockstep",
                                          "--tour",
                                          stops_->name(),
                                          "--language",
                                          "en",
                                          "--output",
                                          Tour().string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    child_ = StartDocent(arguments, Tour().string() + ".out", Tour().string() + ".err");
    Wait("the window", FocusWindow);
  }
  // Waits until the walk has ended.
  void End() {
    Wait("the end", [this] { return !IsRunning(); });
    int status = -1;
    if (!IsRunning()) waitpid(std::exchange(child_, -1), &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << ReadAll(Tour().string() + ".err");
  }

  // Waits until something is the case, at most as long as a heavily loaded machine, or a program with
  // AddressSanitizer, needs for the walk.
  bool Wait(const std::string& what, const std::function<bool()>& is_so) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(15);
    while (std::chrono::steady_clock::now() < end && (IsRunning() || child_ == -1)) {
      if (is_so()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    if (is_so()) return true;
    ADD_FAILURE() << "waited in vain for: " << what << (IsRunning() ? "" : " (the program has ended)") << "\n"
                  << testing::PrintToString(Told("tour")) << testing::PrintToString(Told("command"));
    return false;
  }
  // The events of a kind so far.
  std::vector<std::string> Told(const std::string& kind) const {
    const std::filesystem::path whole = Tour() / "events.csv", begun = Tour() / "events.csv.part";
    const bool has_ended = std::filesystem::exists(whole);
    if (!has_ended && !std::filesystem::exists(begun)) return {};
    return EventsOf(kind, has_ended ? whole : begun);
  }
  bool WaitFor(const std::string& kind, const std::string& part, int count = 1) {
    return Wait(std::to_string(count) + " times " + kind + " '" + part + "'",
                [&] { return Count(kind, part) >= count; });
  }
  // While the visitor rests and comes to the next stop, nothing is done, and nobody has to wait for it.
  void RestUntil(const std::string& kind, const std::string& part, int count = 1) {
    Key("f");
    WaitFor(kind, part, count);
    Key("f");
  }
  int Count(const std::string& kind, const std::string& part) const {
    int count = 0;
    for (const std::string& told : Told(kind)) count += told.find(part) != std::string::npos;
    return count;
  }

  // The key's release may reach no window any more.
  static void Xdotool(const std::string& commands) {
    const int ignored = std::system(("xdotool " + commands + " > /dev/null 2>&1").c_str());
    static_cast<void>(ignored);
  }
  static void Key(const std::string& key) { Xdotool("keydown " + key + " sleep 0.1 keyup " + key); }
  // Presses a key until an event of this kind has followed; `key` may do nothing while nothing is in view. A
  // slow program is given its time: what was pressed twice would be done twice.
  void KeyUntil(const std::string& key, const std::string& kind, const std::string& part) {
    const int before = Count(kind, part);
    const auto has_followed = [&] { return Count(kind, part) > before; };
    Wait("the effect of " + key + " on " + kind, [&] {
      Key(key);
      if (!WaitUntil(has_followed, std::chrono::seconds(3))) AwaitKeys(has_followed);
      return has_followed();
    });
  }
  // Waits until the window has taken all keys so far, or the effect of the last one has followed. The window
  // takes keys in their order, so that it has taken them when it shows the menu.
  void AwaitKeys(const std::function<bool()>& has_followed) {
    Key("m");
    Wait("the menu", [&] { return ChosenRow() >= 0 || has_followed(); });
    Key("Escape");
  }
  // Presses a key once, and waits until an event of this kind has followed. A slow program is given its time:
  // what was pressed twice would be done twice.
  void KeyOnce(const std::string& key, const std::string& kind, const std::string& part) {
    const int before = Count(kind, part);
    Key(key);
    WaitFor(kind, part, before + 1);
  }

  // The row of the screen where the chosen line of the menu begins: a line of its border's colour that is as
  // long as a line of the menu; -1 while no menu is open.
  int ChosenRow() const {
    const cv::Mat screen = reader_.Capture();
    constexpr int kLong_px = 200;
    for (int y = 0; y < screen.rows; ++y) {
      int run = 0;
      for (int x = 0; x < screen.cols; ++x) {
        const auto& pixel = screen.at<cv::Vec3b>(y, x);
        const bool is_border = pixel[2] > 235 && pixel[1] > 190 && pixel[1] < 235 && pixel[0] < 150;
        run = is_border ? run + 1 : 0;
        if (run >= kLong_px) return y;
      }
    }
    return -1;
  }
  // Holds the one button until the screen shows what that is for.
  void HoldUntil(const std::string& what, const std::function<bool()>& is_so) {
    Xdotool("keydown space");
    Wait(what, is_so);
    Xdotool("keyup space");
  }
  // With the one button, takes this line of the menu, counted from 0.
  void TakeFromMenu(int line) {
    HoldUntil("the menu", [this] { return ChosenRow() >= 0; });
    for (int i = 0; i < line; ++i) {
      const int before = ChosenRow();
      Key("space");
      Wait("the next line of the menu", [&] { return ChosenRow() > before; });
    }
    HoldUntil("the choice", [this] { return ChosenRow() < 0; });
  }

  // Checks what the program has written about the visit.
  void ExpectACompleteVisit() {
    EXPECT_THAT(Told("tour"), ElementsAreArray(FiveStopsMuseum::ToldOfTour()));
    EXPECT_THAT(Told("card"), ElementsAreArray({"'sign-1' opened"}));
    const TrueMuseum walk(walk_);
    double lost_s = 0;
    std::optional<double> last_s;
    std::set<std::string> only_turned;  // The times of the images of which only the rotation is known.
    for (const Row& row : ReadFrames(Tour() / "frames.csv")) {
      if (row.at("state") == "panorama") only_turned.insert(row.at("timestamp"));
      if (row.at("map").empty()) continue;
      const double seconds = ToSeconds(*ParseSeconds(row.at("timestamp")));
      if (last_s) lost_s = std::max(lost_s, seconds - *last_s);
      last_s = seconds;
    }
    EXPECT_GE(lost_s, kRest_s);
    int arrows = 0;
    double worst_deg = 0;
    for (const Row& row : ReadFrames(Tour() / "guidance.csv")) {
      if (only_turned.contains(row.at("timestamp"))) continue;
      ++arrows;
      worst_deg = std::max(worst_deg, stops_->ErrorOf_deg(row, walk));
    }
    EXPECT_GE(arrows, 30);
    EXPECT_LE(worst_deg, 15);
    RecordProperty("worst_direction_error_deg", FormatNumber(worst_deg, 3));
    RecordProperty("longest_loss_s", FormatNumber(lost_s, 4));
    std::cout << arrows << " arrows, the worst off by " << worst_deg << " degrees; lost for " << lost_s
              << " s\n";
  }

  std::filesystem::path Tour() const { return folder_ / "tour"; }
  bool IsRunning() const {
    if (child_ <= 0) return false;
    siginfo_t ended{};
    waitid(P_PID, static_cast<id_t>(child_), &ended, WEXITED | WNOHANG | WNOWAIT);
    return ended.si_pid == 0;
  }

  const TemporaryFolder folder_;
  VirtualScreen screen_{"640x480", folder_.path().string()};
  const ScreenReader reader_{folder_.path()};
  std::optional<FiveStopsMuseum> stops_;
  double rest_at_s_ = 0;
  std::string walk_;  // The scene of the simulator.
  pid_t child_ = -1;
};

TEST_F(VisitorOfFiveStops, CompletesTheTourWithOneButton) {
  Begin();
  WaitFor("tour", "arrived at 'Bay 5'");
  KeyUntil("space", "card", "'sign-1' opened");
  KeyUntil("space", "command", "tour press");  // Closes it.
  WaitFor("tour", "arrived at 'Bay 0'");
  for (int i = 0; i < 3; ++i) TakeFromMenu(1);
  RestUntil("tour", "arrived at 'Bay 4'", 2);
  TakeFromMenu(0);
  End();
  ExpectACompleteVisit();
}

TEST_F(VisitorOfFiveStops, CompletesTheTourWithTheKeyboardAlone) {
  Begin();
  WaitFor("tour", "arrived at 'Bay 5'");
  KeyUntil("Right", "command", "tour mark");
  KeyUntil("Return", "card", "'sign-1' opened");
  KeyUntil("Escape", "command", "tour close");
  WaitFor("tour", "arrived at 'Bay 0'");
  KeyOnce("b", "tour", "going back to 'Bay 3'");
  Key("l");
  KeyOnce("b", "tour", "going back to 'Bay 5'");
  Key("l");
  // The menu does the same.
  Key("m");
  Wait("the menu", [this] { return ChosenRow() >= 0; });
  Key("Down");
  KeyOnce("Return", "tour", "going back to 'Bay 4'");
  RestUntil("tour", "arrived at 'Bay 4'", 2);
  KeyOnce("n", "tour", "skipped 'Bay 2'");
  End();
  ExpectACompleteVisit();
}

// The visitor hears, and does not see.
TEST_F(VisitorOfFiveStops, CompletesTheTourByWhatIsSpoken) {
  Begin({"--narrate"});
  WaitFor("narration", "Stop 2 of 5. Next: Bay 3");
  KeyUntil("Return", "card", "'sign-1' opened");
  KeyUntil("Escape", "command", "tour close");
  WaitFor("narration", "Stop 4 of 5. Next: Bay 2");
  KeyOnce("b", "narration", "Back to Bay 3, 3 of 5");
  KeyOnce("b", "narration", "Back to Bay 5, 2 of 5");
  KeyOnce("b", "narration", "Back to Bay 4, 1 of 5");
  RestUntil("narration", "Stop 1 of 5. Next: Bay 2");
  KeyOnce("n", "narration", "The tour ends here. You saw 4 of 5 stops.");
  End();
  ExpectACompleteVisit();
  const std::vector<std::string> spoken = Told("narration");
  auto named = spoken.begin();
  for (const char* place : {"Bay 4", "Bay 5", "Bay 3", "Bay 0", "Bay 4"}) {
    named = std::find(named, spoken.end(), place);
    EXPECT_TRUE(named != spoken.end()) << place << " in " << testing::PrintToString(spoken);
  }
  EXPECT_THAT(spoken, Contains("To Bay 3")) << "the card and the signpost are read";
  EXPECT_THAT(spoken, Contains(HasSubstr(": To Bay 3"))) << "the side of the way on is said";
  EXPECT_THAT(spoken, Contains(AnyOf(HasSubstr("Go back to Bay 0"), HasSubstr("where you see one of these"))))
      << "what to do when nothing is recognized";
  EXPECT_THAT(spoken, Contains(HasSubstr("Go to one of these places")));
}

}  // namespace
}  // namespace docent::app

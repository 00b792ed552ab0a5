// SPDX-License-Identifier: Apache-2.0
// The real program is told to end while it works, by Ctrl-C (SIGINT) or by the system (SIGTERM).
#include <fcntl.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "maps/library/library.h"
#include "tests/app/support/temporary_folder.h"
#include "tests/end_to_end/run_docent.h"

namespace docent::app {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Images of an hour, black after twenty seconds: no run ends by itself meanwhile.
constexpr const char* kLongWalk = "sim:room,rest=3600,rest-at=20";

class RunningProgram : public ::testing::Test {
 protected:
  void TearDown() override {
    if (child_ > 0) {
      kill(child_, SIGKILL);
      waitpid(child_, nullptr, 0);
    }
  }

  void Start(const std::vector<std::string>& arguments, const std::string& input = "/dev/null",
             bool can_stop = false) {
    child_ = StartDocent(arguments, (folder_ / "out").string(), (folder_ / "err").string(), input, can_stop);
  }
  bool IsRunning() const {
    siginfo_t ended{};
    waitid(P_PID, static_cast<id_t>(child_), &ended, WEXITED | WNOHANG | WNOWAIT);
    return ended.si_pid == 0;
  }
  // Waits until something is the case while the program runs, at most four minutes.
  void WaitUntil(const std::function<bool()>& is_so) const {
    const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(4);
    while (!is_so() && IsRunning() && std::chrono::steady_clock::now() < end)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  // Waits for the end; empty if the program still runs.
  std::optional<int> ExitStatus() {
    WaitUntil([] { return false; });
    if (IsRunning()) return std::nullopt;
    int status = -1;
    waitpid(std::exchange(child_, -1), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  std::string Errors() const { return ReadAll(folder_ / "err"); }

  const TemporaryFolder folder_;
  const std::string library_ = (folder_ / "room.docent").string(), output_ = (folder_ / "run").string();
  pid_t child_ = -1;
};

// The parameter is the signal.
class InterruptedProgram : public RunningProgram, public ::testing::WithParamInterface<int> {
 protected:
  // Whether the program has said that it handles the signal itself.
  bool HandlesTheSignal() const {
    const std::string status = ReadAll("/proc/" + std::to_string(child_) + "/status"), name = "SigCgt:";
    const std::size_t at = status.find(name);
    if (at == std::string::npos) return false;
    return std::stoull(status.substr(at + name.size()), nullptr, 16) >> (GetParam() - 1) & 1;
  }
  // Sends the signal and waits for the end; empty if the program still runs.
  std::optional<int> Interrupt() {
    EXPECT_TRUE(IsRunning()) << Errors();
    kill(child_, GetParam());
    return ExitStatus();
  }
};
INSTANTIATE_TEST_SUITE_P(Interruption, InterruptedProgram, ::testing::Values(SIGINT, SIGTERM),
                         [](const auto& signal) { return signal.param == SIGINT ? "CtrlC" : "Terminate"; });

TEST_P(InterruptedProgram, SavesTheMapOfAnAuthor) {
  const auto script = folder_.Write("script.txt", "0.1 map new Room\n");
  Start({"author", "--library", library_, "--camera", kLongWalk, "--headless", "--pace", "lockstep",
         "--script", script.string(), "--output", output_});
  WaitUntil(
      [&] { return ReadAll(folder_ / "run/events.csv.part").find("started Room") != std::string::npos; });
  EXPECT_EQ(Interrupt(), 0) << Errors();
  EXPECT_THAT(ReadAll(folder_ / "run/events.csv"), HasSubstr("started Room"));
  const maps::Library library = maps::Library::Open(library_, maps::Access::kReadOnly);
  EXPECT_THAT(library.Verify(), IsEmpty());
  const maps::MapInfo room = library.FindByName("Room");
  EXPECT_GE(library.Load(room.key).snapshot->keyframes.size(), 2u);
}

TEST_P(InterruptedProgram, EndsATourWell) {
  {
    maps::Library library =
        maps::Library::Open(library_, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    library.Save({library.NewKey(), "Lions", maps::Policy::kOpen, nullptr, nullptr});
  }
  Start({"tour", "--library", library_, "--camera", kLongWalk, "--headless", "--output", output_});
  WaitUntil([this] { return HandlesTheSignal(); });
  EXPECT_EQ(Interrupt(), 0) << Errors();
  EXPECT_TRUE(std::filesystem::exists(folder_ / "run/events.csv"));
}

TEST_P(InterruptedProgram, EndsTheDemonstrationBeforeItsTour) {
  Start({"demo", "--headless", "--output", output_});
  WaitUntil([this] { return std::filesystem::exists(folder_ / "run/author/events.csv.part"); });
  EXPECT_EQ(Interrupt(), 1) << Errors();
  EXPECT_THAT(Errors(), EndsWith("docent: Interrupted; the demonstration is incomplete.\n"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "run/tour"));
  EXPECT_THAT(ReadAll(folder_ / "out"), IsEmpty());
}

TEST_P(InterruptedProgram, WritesNoCalibration) {
  const std::string calibration = (folder_ / "camera.yaml").string();
  Start({"calibrate", "--camera", kLongWalk, "--headless", "--output", calibration});
  WaitUntil([this] { return HandlesTheSignal(); });
  EXPECT_EQ(Interrupt(), 1);
  EXPECT_THAT(Errors(), EndsWith("docent: Interrupted; nothing was written.\n"));
  EXPECT_FALSE(std::filesystem::exists(calibration));
}

// An administrator who is asked for the password of a new user, on a terminal that hides what is typed.
class PasswordAtTerminal : public RunningProgram {
 protected:
  void SetUp() override {
    keyboard_ = posix_openpt(O_RDWR | O_NOCTTY);
    if (keyboard_ < 0) GTEST_SKIP() << "this system has no pseudo-terminals";
    ASSERT_EQ(grantpt(keyboard_), 0);
    ASSERT_EQ(unlockpt(keyboard_), 0);
    const std::string terminal = ptsname(keyboard_);
    // While it is open, the terminal keeps its settings when the program ends.
    screen_ = open(terminal.c_str(), O_RDWR | O_NOCTTY);
    ASSERT_GE(screen_, 0);
    ASSERT_TRUE(ShowsWhatIsTyped());
    before_ = Settings();
    Start({"hub", "user", "add", "anna", "--role", "curator", "--password", "--hub", "postgresql:///docent"},
          terminal, /*can_stop=*/true);
    WaitUntil([this] { return Questions() == 1; });
    ASSERT_EQ(Questions(), 1) << Errors();
    ASSERT_FALSE(ShowsWhatIsTyped());
  }
  void TearDown() override {
    RunningProgram::TearDown();
    for (const int file : {screen_, keyboard_}) {
      if (file >= 0) close(file);
    }
  }

  termios Settings() const {
    termios settings{};
    EXPECT_EQ(tcgetattr(screen_, &settings), 0);
    return settings;
  }
  bool ShowsWhatIsTyped() const { return (Settings().c_lflag & ECHO) != 0; }
  // How often the question was asked.
  int Questions() const {
    const std::string errors = Errors(), question = "Password of anna: ";
    int count = 0;
    for (std::size_t at = 0; (at = errors.find(question, at)) != std::string::npos; ++at) ++count;
    return count;
  }
  bool IsStopped() const {
    siginfo_t stopped{};
    waitid(P_PID, static_cast<id_t>(child_), &stopped, WSTOPPED | WNOHANG | WNOWAIT);
    return stopped.si_pid != 0;
  }
  void Type(const std::string& typed) const {
    ASSERT_EQ(write(keyboard_, typed.data(), typed.size()), static_cast<ssize_t>(typed.size()));
  }

  int keyboard_ = -1, screen_ = -1;
  termios before_{};
};

TEST_F(PasswordAtTerminal, CtrlCEndsTheQuestionAtOnce) {
  Type("secret\x03");
  EXPECT_EQ(ExitStatus(), 1) << Errors();
  EXPECT_THAT(Errors(), EndsWith("docent: Interrupted; the user was not added.\n"));
  EXPECT_TRUE(ShowsWhatIsTyped());
  EXPECT_EQ(Settings().c_cc[VINTR], before_.c_cc[VINTR]);
}

TEST_F(PasswordAtTerminal, ASignalThatEndsTheProgramLeavesATerminalThatShowsWhatIsTyped) {
  // The key Ctrl-\ sends its signal at once.
  EXPECT_NE(Settings().c_lflag & ISIG, 0u);
  kill(child_, SIGTERM);
  EXPECT_EQ(ExitStatus(), 128 + SIGTERM) << Errors();
  EXPECT_TRUE(ShowsWhatIsTyped());
}

TEST_F(PasswordAtTerminal, TheTerminalShowsWhatIsTypedWhileTheProgramIsStoppedAndTheQuestionIsAskedAnew) {
  kill(child_, SIGTSTP);  // As by the key Ctrl-Z.
  WaitUntil([this] { return IsStopped(); });
  ASSERT_TRUE(IsStopped());
  EXPECT_TRUE(ShowsWhatIsTyped());
  kill(child_, SIGCONT);
  WaitUntil([this] { return Questions() == 2; });
  ASSERT_EQ(Questions(), 2) << Errors();
  EXPECT_FALSE(ShowsWhatIsTyped());
  Type("\x03");
  EXPECT_EQ(ExitStatus(), 1) << Errors();
  EXPECT_TRUE(ShowsWhatIsTyped());
}

}  // namespace
}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/kiosk.h"

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <system_error>

#include "app/files/text_file.h"
#include "engine/base/error.h"

namespace docent::app {

namespace {

std::atomic<pid_t> g_child = 0;
std::atomic<bool> g_ends = false;
static_assert(std::atomic<pid_t>::is_always_lock_free, "a signal handler may only use lock-free atomics");

void EndChild(int signal) {
  g_ends = true;
  if (const pid_t child = g_child; child > 0) kill(child, signal);
}

// Returns the status of waitpid.
int WaitForChild(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

}  // namespace

std::string ReadKioskCode(const std::filesystem::path& file) {
  constexpr std::size_t kMaxBytes = 100, kLeast = 4, kMost = 12;
  std::string code = ReadTextFile(file, kMaxBytes);
  while (!code.empty() && (code.back() == '\n' || code.back() == '\r')) code.pop_back();
  const bool digits = std::all_of(code.begin(), code.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (!digits || code.size() < kLeast || code.size() > kMost)
    throw Error("'" + file.string() + "' must contain a code of 4 to 12 digits and nothing else.");
  return code;
}

bool KioskLock::Add(const std::string& key, Clock::time_point now) {
  constexpr auto kPause = std::chrono::seconds(5);  // Staff who know the code type it faster.
  if (!is_locked()) return false;
  const bool is_digit = key.size() == 1 && key[0] >= '0' && key[0] <= '9';
  if (!is_digit || now - last_ > kPause) typed_.clear();
  last_ = now;
  if (!is_digit) return false;
  typed_ += key;
  if (typed_.size() > code_.size()) typed_.erase(0, 1);
  return typed_ == code_;
}

bool RestartAfterFailures() {
  constexpr unsigned kFirstPause_s = 1, kLongestPause_s = 30;
  constexpr auto kStable = std::chrono::minutes(1);  // What ran so long has not failed at its start.
  unsigned pause_s = kFirstPause_s;
  std::signal(SIGINT, EndChild);
  std::signal(SIGTERM, EndChild);
  while (!g_ends) {
    const auto begin = KioskLock::Clock::now();
    std::fflush(nullptr);  // Otherwise the child would write it again.
    const pid_t child = fork();
    if (child < 0) throw Error("No process can be started: " + std::generic_category().message(errno) + ".");
    if (child == 0) {
      std::signal(SIGINT, SIG_DFL);
      std::signal(SIGTERM, SIG_DFL);
      setpgid(0, 0);  // Ctrl-C reaches the parent alone, which passes it on once.
      prctl(PR_SET_PDEATHSIG, SIGTERM);
      return true;
    }
    g_child = child;
    const int status = WaitForChild(child);
    g_child = 0;
    if (g_ends || (WIFEXITED(status) && WEXITSTATUS(status) == 0)) break;
    if (KioskLock::Clock::now() - begin > kStable) pause_s = kFirstPause_s;
    std::fprintf(stderr, "docent: The tour has ended unexpectedly; it begins again in %u s.\n", pause_s);
    const timespec pause{static_cast<time_t>(pause_s), 0};
    nanosleep(&pause, nullptr);  // A signal ends it.
    pause_s = std::min(2 * pause_s, kLongestPause_s);
  }
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
  return false;
}

}  // namespace docent::app

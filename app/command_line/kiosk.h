// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <filesystem>
#include <string>

namespace docent::app {

// The code of a kiosk, by which its staff end the program: 4 to 12 digits, alone in the first line of a file.
// A file, because every user of the machine can read a command line. Throws Error.
std::string ReadKioskCode(const std::filesystem::path& file);

// Recognizes the code among keys that are pressed one after another. One thread.
class KioskLock {
 public:
  using Clock = std::chrono::steady_clock;

  // `code`: empty for a program that is not locked.
  explicit KioskLock(std::string code) : code_(std::move(code)) {}

  bool is_locked() const { return !code_.empty(); }
  // A key, by its name in ui::InputEvent. Returns whether it completes the code. A key that is no digit, or a
  // pause of several seconds, begins anew.
  bool Add(const std::string& key, Clock::time_point now);

 private:
  const std::string code_;
  std::string typed_;  // The last digits, at most as many as the code has.
  Clock::time_point last_{};
};

// To be called before there are threads. Returns true in a child process, which is to do the work, and starts
// another one whenever it fails. Returns false in the calling process once a child has ended without an error
// or SIGINT or SIGTERM, which are passed on to the child, has come. Throws Error when no process can be
// started.
bool RestartAfterFailures();

}  // namespace docent::app

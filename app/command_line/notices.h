// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/script/commands.h"

namespace docent::app {

// What the person at the window has to know, beyond what each frame shows.
struct Notice {
  // Why a command was refused, or what went wrong: one sentence. Empty for a command that was carried out.
  std::string problem;
  std::optional<Command> done;
  std::optional<std::string> activity = std::nullopt;  // What is going on, in a few words.
};

// What is not saved yet, and when something was saved last.
struct SavingState {
  bool unsaved = false;
  std::optional<std::chrono::steady_clock::time_point> saved_at;
};

// Hands notices from the threads of the cameras to that of the window. Any thread.
class NoticeQueue {
 public:
  void Push(Notice notice) {
    const std::scoped_lock lock(mutex_);
    notices_.push_back(std::move(notice));
  }
  std::vector<Notice> TakeAll() {
    const std::scoped_lock lock(mutex_);
    return std::exchange(notices_, {});
  }

 private:
  std::mutex mutex_;
  std::vector<Notice> notices_;
};

}  // namespace docent::app

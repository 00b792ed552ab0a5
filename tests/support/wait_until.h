// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <thread>

namespace docent {

// Waits until another thread or process has brought about what a test expects, at most this long. Returns
// whether it has. By default it takes so long only when the test fails, also on a loaded machine.
inline bool WaitUntil(const std::function<bool()>& is_so,
                      std::chrono::milliseconds longest = std::chrono::minutes(2)) {
  const auto end = std::chrono::steady_clock::now() + longest;
  while (!is_so()) {
    if (std::chrono::steady_clock::now() >= end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return true;
}

// The same for what a program is to bring about: what it has not done at its end is not waited for.
inline bool WaitWhileRunning(const std::function<bool()>& is_running, const std::function<bool()>& is_so,
                             std::chrono::milliseconds longest = std::chrono::minutes(2)) {
  bool is = false;
  WaitUntil(
      [&] {
        const bool has_ended = !is_running();  // Asked first, so that what the program did last counts.
        return (is = is_so()) || has_ended;
      },
      longest);
  return is;
}

}  // namespace docent

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace docent::app {

// While an instance exists, the first SIGINT (Ctrl-C) or SIGTERM only sets a flag, so that the running
// command can save and close its files. Another signal of the same kind ends the program at once, but not
// within 2 s of the first: a service manager signals all processes of a kiosk, and its parent passes the
// signal on too. One instance at a time, created on the main thread.
class Interruption {
 public:
  // `repeats`: how long after the first signal others of its kind are ignored.
  explicit Interruption(std::chrono::milliseconds repeats = std::chrono::seconds(2));
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  // Whether a signal has arrived. Any thread.
  static bool requested();
};

}  // namespace docent::app

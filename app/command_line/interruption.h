// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace docent::app {

// While an instance exists, the first SIGINT (Ctrl-C) or SIGTERM only sets a flag, so that the running
// command can save and close its files. A second signal of the same kind ends the program at once. One
// instance at a time, created on the main thread.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  // Whether a signal has arrived. Any thread.
  static bool requested();
};

}  // namespace docent::app

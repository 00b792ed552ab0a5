// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace docent::app {

// While one exists, Ctrl-C and the system's request to end (SIGINT, SIGTERM) are only noted, so that what
// runs can save and close its files. A second Ctrl-C ends the program at once. One at a time, on the main
// thread.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  // Any thread.
  static bool requested();
};

}  // namespace docent::app

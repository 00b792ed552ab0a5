// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "ui/window.h"

namespace docent::ui {

// Dear ImGui sees only which keys are down in a frame: a key that is pressed and released between two frames
// would have no effect, and the order of several keys would be lost. With this queue, every key is down in a
// frame of its own, in the order in which the keys were pressed, however long a frame takes. On the window's
// thread.
class KeyQueue {
 public:
  // Before each frame of the current context of Dear ImGui.
  void Update(Window* window);
  // Whether no key waits for its turn or has it in this frame.
  bool empty() const { return waiting_.empty() && !given_; }

 private:
  std::deque<PressedKey> waiting_;
  std::optional<PressedKey> given_;  // Down in this frame, because it is its turn.
};

}  // namespace docent::ui

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <optional>

#include "ui/window.h"

namespace docent::ui {

// Dear ImGui 1.86 sees only which keys are down in a frame: a key that is pressed and released between two
// frames would have no effect, the order of several keys and of the characters between them would be lost,
// and characters are dropped in a frame in which Ctrl is down. With this queue, every key is down in a frame
// of its own, and characters are written in their turn, however long a frame takes. On the window's thread.
class KeyQueue {
 public:
  // Before each frame of the current context of Dear ImGui.
  void Update(Window* window);
  // Whether nothing waits for its turn, and no key has it in this frame.
  bool empty() const { return waiting_.empty() && !given_; }

 private:
  std::deque<TypedInput> waiting_;
  std::optional<TypedInput> given_;  // The key that is down in this frame, because it is its turn.
};

}  // namespace docent::ui

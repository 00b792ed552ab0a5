// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "ui/authoring_actions.h"
#include "ui/message_board.h"
#include "ui/window_layout.h"

namespace docent::ui {

// Draws the messages above the bottom of the image, errors with a button that dismisses them and the last
// change with one that undoes it. With many messages it scrolls. Returns its height in window units, 0
// without messages. Between Gui::Begin and Gui::Draw.
double DrawMessages(const WindowLayout& layout, MessageBoard* board, AuthoringActions* actions);

// The question before the window closes with unsaved changes. One per window.
class QuitDialog {
 public:
  void Open() { opens_ = true; }
  // From Open on, also before the next frame shows it.
  bool is_open() const { return opens_ || is_open_; }
  // Between Gui::Begin and Gui::Draw. Escape cancels.
  void Draw(const WindowLayout& layout, AuthoringActions* actions);

 private:
  bool opens_ = false, is_open_ = false;
};

}  // namespace docent::ui

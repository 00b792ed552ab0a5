// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>

#include "ui/window.h"

namespace docent::ui {

// Dear ImGui on a window: fonts, colours, input. One per window, used on the window's thread and destroyed
// before the window. Between Begin and Draw, widgets may be made.
class Gui {
 public:
  // Throws docent::Error when Dear ImGui does not work with this OpenGL driver.
  explicit Gui(Window* window);
  ~Gui();
  Gui(const Gui&) = delete;
  Gui& operator=(const Gui&) = delete;

  // Begins a frame. `scale` is that of the interface (WindowLayout::scale); fonts are made anew when it
  // changes.
  void Begin(double scale);
  // Ends the frame and draws the widgets into the default framebuffer.
  void Draw();

  // Whether a pointer at this point is over a widget or held by one; such events are not those of the image.
  // It counts what the last frame shows, wherever the pointer was then.
  bool WantsMouse(const Eigen::Vector2d& point) const;
  // Clicks at this point, as with the left button of a mouse: holds it in the next frame and releases it in
  // the one after, also if the pointer moves on. Further clicks follow in their order.
  void Click(const Eigen::Vector2d& point);
  // Whether keys write into a text field.
  bool WritesText() const;
  // Whether a drop-down or dialog is open, which Escape closes.
  bool HasPopup() const;
  // Whether arrow keys, Tab, Space and Enter go through the widgets, as after FocusWindow.
  bool IsNavigated() const;
  // Lets the keyboard go through the widgets of a window from the next frame on, or leave all widgets.
  void FocusWindow(const char* name);
  void LeaveWidgets();
  // Lets the text field that is being written be left as by a click elsewhere, so that what was typed becomes
  // a change. It is left in the second frame from now on, since what was typed last reaches it in the first;
  // later if several keys were pressed between two frames.
  void LeaveField();
  // Whether that frame has not begun yet.
  bool IsLeavingField() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::ui

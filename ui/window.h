// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "ui/context.h"

struct GLFWwindow;

namespace docent::ui {

// An input event of a window. Positions are in screen units from the window's top-left corner, y down.
struct InputEvent {
  enum class Kind { kClick, kRelease, kKey, kKeyUp, kDrop, kResize, kClose } kind = Kind::kKey;
  // kClick, kRelease, kDrop: where the button was pressed or released, or the files were dropped.
  Eigen::Vector2d position = Eigen::Vector2d::Zero();
  int button = 0;  // kClick, kRelease: 0 left, 1 right, 2 middle
  // kKey, kKeyUp: "a" … "z", "0" … "9", "escape", "space", "enter", "tab", "f1" … "f12", "left", "up" …; see
  // KeyName
  std::string key;
  bool control = false, shift = false;  // kKey, kClick
  bool repeated = false;                // kKey: the key is held
  std::vector<std::string> files;       // kDrop: paths
  int width_px = 0, height_px = 0;      // kResize: the size of the framebuffer
};

// The name that InputEvent::key has for a key of GLFW; empty for keys that Docent does not use. `written`:
// what the key writes in the user's layout without Shift (UTF-8); empty where it writes nothing. A letter is
// the one that is written, so that Ctrl-Z is where the user reads Z.
std::string KeyName(int key, const std::string& written);

// What was typed for a widget: a character, or a key that does more than to write one.
struct TypedInput {
  unsigned character = 0;  // Unicode; 0 for a key.
  int key = 0;             // GLFW_KEY_...
  int index = 0;  // Dear ImGui's index of the key: that of a US keyboard that writes the same letter.
  bool control = false, shift = false;  // While the key was pressed.
};

// A window with an OpenGL 3.3 core context (GLFW). It may only be used on the thread that constructed it,
// which must be the program's main thread (a rule of GLFW).
class Window : public GraphicsContext {
 public:
  // The window is at most as large as the monitor allows. Throws docent::Error with a one-sentence message
  // when there is no display or the display has no OpenGL 3.3.
  Window(const std::string& title, int width_px, int height_px);
  ~Window() override;
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  void MakeCurrent() override;
  // Returns the events since the last call, in order. Does not wait.
  std::vector<InputEvent> PollEvents();
  // Returns what was typed during the last call of PollEvents, in order, and forgets it.
  std::vector<TypedInput> TakeTyped();
  // Shows the contents of the default framebuffer; waits for the screen when vertical sync is on.
  void Show();
  // Of the monitor that the window was opened on, as it reports it; 96 dots per inch where it reports nothing
  // plausible.
  double PixelsPerMillimetre() const;
  // Whether the user asked to close the window. KeepOpen takes that back.
  bool IsClosing() const;
  void KeepOpen();
  // Changes between a window and the whole primary monitor.
  void ToggleFullScreen();
  // The size of the default framebuffer in pixels, and of the window in the units of InputEvent::position.
  Eigen::Vector2i FramebufferSize() const;
  Eigen::Vector2i WindowSize() const;
  // The pointer in the units of InputEvent::position; outside the window it may be negative.
  Eigen::Vector2d PointerPosition() const;
  // Moves the pointer by window units, within the window; without effect while another window is used.
  void MovePointer(const Eigen::Vector2d& by);
  bool IsControlDown() const;
  // The size that the monitor suggests for texts, relative to a monitor of 96 dpi, per window unit.
  double ContentScale() const;
  // For the authoring panel, which handles input of the same window.
  GLFWwindow* handle() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::ui

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "ui/context.h"

struct GLFWwindow;

namespace docent::ui {

// What a person did to a window. Positions are in screen units from the window's top-left corner, y down.
struct InputEvent {
  enum class Kind { kClick, kKey, kResize, kClose } kind = Kind::kKey;
  Eigen::Vector2d position = Eigen::Vector2d::Zero();  // kClick: where the button went down
  int button = 0;                                      // kClick: 0 left, 1 right, 2 middle
  // kKey: "a" … "z", "0" … "9", "escape", "space", "enter", "tab", "f1" … "f12", "left", "up" …
  std::string key;
  bool control = false, shift = false;  // kKey, kClick
  int width_px = 0, height_px = 0;      // kResize: of the framebuffer
};

// A window with an OpenGL 3.3 core context (GLFW). One thread, the one that constructed it; it must be the
// program's main thread (GLFW's rule).
class Window : public GraphicsContext {
 public:
  // Throws docent::Error with one sentence: no display, or no OpenGL 3.3 on it.
  Window(const std::string& title, int width_px, int height_px);
  ~Window() override;
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  void MakeCurrent() override;
  // What happened since the last call, in order. Never waits.
  std::vector<InputEvent> PollEvents();
  // Shows what was drawn into the default framebuffer; waits for the screen when vertical sync is on.
  void Show();
  // Whether the person asked to close it.
  bool IsClosing() const;
  // Size of the default framebuffer in pixels, and of the window in the units of InputEvent::position.
  Eigen::Vector2i FramebufferSize() const;
  Eigen::Vector2i WindowSize() const;
  // For the authoring panel, which listens to the same window.
  GLFWwindow* handle() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::ui

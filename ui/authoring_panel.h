// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ui/renderer.h"
#include "ui/window.h"

namespace docent::ui {

// The small panel over the image with which a person authors (Dear ImGui): new map, stop map, place model,
// signpost, undo, redo, save, and what to show. It changes nothing itself: every action leaves as a line of
// the script language. One in a window, on the window's thread; destroyed before the window.
class AuthoringPanel {
 public:
  using Emit = std::function<void(std::string command)>;
  enum class Tool { kNone, kModel, kSignpost };

  // The person's choices, shown and changed by the panel, and by whoever owns it (a key, a test).
  struct State {
    Tool tool = Tool::kNone;  // what a click in the image places
    std::string map_name;
    std::string model_file;
    double scale = 1.0, yaw_deg = 0.0;
    std::string sign_text, sign_to_map;
    bool show_points = false, show_keyframes = false, show_hud = true;
  };

  // models: files to choose from; map_names are the maps that a signpost may point to.
  AuthoringPanel(Window* window, Emit emit, std::vector<std::string> models = {});
  ~AuthoringPanel();
  AuthoringPanel(const AuthoringPanel&) = delete;
  AuthoringPanel& operator=(const AuthoringPanel&) = delete;

  void SetMapNames(std::vector<std::string> map_names);
  State& state();
  // Copies the toggles; the overlay's texts stay.
  void ApplyTo(Overlay* overlay) const;

  // Draws into the default framebuffer, after the image was presented and before Window::Show.
  void Draw();
  // Whether the pointer is over the panel or a text field has the keyboard: such events are not the
  // image's.
  bool WantsMouse() const;
  bool WantsKeyboard() const;
  // A click in the image, at one of its pixels: places what the tool says. Without a tool, or with nothing
  // chosen to place, nothing happens. Answers whether a command was emitted.
  bool ClickImage(const Eigen::Vector2d& pixel);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::ui

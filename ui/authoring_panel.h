// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "ui/renderer.h"
#include "ui/window.h"

namespace docent::ui {

// What a person asks for in the panel. Called on the window's thread; implementations do not throw.
class AuthoringActions {
 public:
  virtual ~AuthoringActions() = default;
  virtual void NewMap(const std::string& name) = 0;
  virtual void StopMap() = 0;
  // At the surface that the image shows at this pixel. `scale` is in map units per metre of the model.
  virtual void PlaceModel(const std::string& file, const Eigen::Vector2d& pixel, double scale,
                          double yaw_deg) = 0;
  // `to_map` is the map that the signpost leads to; empty for none.
  virtual void PlaceSignpost(const std::string& text, const Eigen::Vector2d& pixel,
                             const std::string& to_map) = 0;
  virtual void Undo() = 0;
  virtual void Redo() = 0;
  virtual void Save() = 0;
};

// The small authoring panel over the image (Dear ImGui): new map, stop map, place model, signpost, undo,
// redo, save, and display options. It changes nothing itself, but calls the actions. One panel per window,
// used on the window's thread and destroyed before the window.
class AuthoringPanel {
 public:
  enum class Tool { kNone, kModel, kSignpost };

  // The user's choices. The panel shows and changes them, and so can its owner (for a key press or a test).
  struct State {
    Tool tool = Tool::kNone;  // What a click in the image places.
    std::string map_name;
    std::string model_file;
    double scale = 1.0, yaw_deg = 0.0;
    std::string sign_text, sign_to_map;
    bool show_points = false, show_keyframes = false, show_hud = true;
  };

  // `actions` must outlive the panel. `models` are the files to choose from.
  AuthoringPanel(Window* window, AuthoringActions* actions, std::vector<std::string> models = {});
  ~AuthoringPanel();
  AuthoringPanel(const AuthoringPanel&) = delete;
  AuthoringPanel& operator=(const AuthoringPanel&) = delete;

  // The maps that a signpost may lead to.
  void SetMapNames(std::vector<std::string> map_names);
  State& state();
  // Copies the display options; the overlay's texts are not changed.
  void ApplyTo(Overlay* overlay) const;

  // Draws into the default framebuffer. Call it after the image was presented and before Window::Show.
  void Draw();
  // Whether the pointer is over the panel or a text field has the keyboard focus; such events must not be
  // handled as events of the image.
  bool WantsMouse() const;
  bool WantsKeyboard() const;
  // Handles a click at this pixel of the image by placing what the selected tool places. Without a tool, or
  // without a model or text to place, nothing happens. Returns whether an action was called.
  bool ClickImage(const Eigen::Vector2d& pixel);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace docent::ui

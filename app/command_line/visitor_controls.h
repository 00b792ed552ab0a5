// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "app/command_line/kiosk.h"
#include "app/script/commands.h"
#include "app/session/guided_view.h"
#include "app/session/visitor_strings.h"
#include "ui/letterbox.h"
#include "ui/visitor_layout.h"
#include "ui/window.h"

namespace docent::app {

// What a visitor does at the window of a tour: by keys, by one button (the space bar), or by touching. The
// button opens what is marked, turns pages and closes; held, it opens the menu, in which it goes from choice
// to choice and, held, chooses. At a kiosk only what leads the visitor does something. On the window's
// thread.
class VisitorControls {
 public:
  using Clock = std::chrono::steady_clock;

  struct Host {
    std::function<void(GuideVisitor)> emit;  // For the frame that is shown.
    std::function<void()> swap_cameras, toggle_full_screen;
    std::function<void()> toggle_fast_forward;  // See WindowLink.
    std::string language;
    bool has_route = false;  // The tour has stops.
    std::string kiosk_code;  // Empty for other tours.
  };
  explicit VisitorControls(Host host);

  // Where things are in the window, in pixels of its framebuffer.
  struct Seen {
    std::shared_ptr<const ShownFrame> frame;  // Null before the first.
    ui::Letterbox box;                        // Where its image is.
    ui::Area inset;                           // The other camera's image; empty without one.
    int width_px = 1, height_px = 1;
    // What has a card, where it was drawn in the image.
    std::vector<ui::CardTarget> targets;
    ui::HeadsUpStyle style;
    double pixels_per_unit = 1;  // Of positions in ui::InputEvent.
  };
  void SetView(Seen seen);
  void Handle(const ui::InputEvent& event, Clock::time_point now);
  // What time brings about: a held button, and a model that is turned by the pointer, which is here in window
  // units.
  void Update(const Eigen::Vector2d& pointer, Clock::time_point now);
  // Adds to what is drawn what was chosen here.
  void AddTo(ui::View* view) const;
  // Whether something that is drawn has changed since the last call.
  bool TakeChange() { return std::exchange(changed_, false); }
  bool closing() const { return closing_; }
  bool is_locked() const { return kiosk_.is_locked(); }

 private:
  void HandleKey(const ui::InputEvent& event, Clock::time_point now);
  void HandleEngineerKey(const std::string& key);
  void HandleArrow(const std::string& key);
  void Touch(const Eigen::Vector2d& point_px);
  void TouchCard(const Eigen::Vector2d& point_px);
  void Press();
  void PressLong();
  // What the menu offers: what leads the visitor, or whether to begin anew.
  enum class Menu { kNone, kSteps, kAnew };
  void OpenMenu(Menu menu);
  void CloseMenu();
  void Choose(std::size_t choice);
  std::vector<std::string> Choices() const;
  void Step(GuideVisitor::Step step, std::string name = {}) { host_.emit({step, std::move(name)}); }
  // The view with what AddTo adds.
  ui::Overlay Shown() const;
  const ui::Card* card() const;

  const Host host_;
  const VisitorStrings& strings_;
  KioskLock kiosk_;
  Seen seen_;
  std::optional<Clock::time_point> held_since_;  // The button; empty once its long press was carried out.
  Menu menu_ = Menu::kNone;
  bool is_asked_ = false;    // By the program, and not by what was chosen in the menu.
  int visitors_before_ = 0;  // See ShownFrame.
  std::size_t chosen_ = 0;
  std::string turned_entity_;  // Of the card whose model was turned.
  std::optional<Eigen::Vector2d> turned_rad_;
  std::optional<Eigen::Vector2d> dragged_from_px_;
  bool lists_route_ = false;
  bool points_ = false, keyframes_ = false, status_ = true, details_ = false;
  bool closing_ = false, changed_ = false;
};

}  // namespace docent::app

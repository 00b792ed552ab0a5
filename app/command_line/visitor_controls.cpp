// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/visitor_controls.h"

#include <algorithm>
#include <numbers>
#include <utility>

#include "ui/card_targets.h"

namespace docent::app {

namespace {

constexpr auto kLongPress = std::chrono::milliseconds(800);  // Longer than a press that trembles.
constexpr double kArrowTurn_rad = std::numbers::pi / 12;
constexpr double kMaxTilt_rad = std::numbers::pi / 2;

enum Choice : std::size_t { kChooseSkip, kChooseBack, kChooseStops, kChooseAnew, kChooseClose };
enum AnewChoice : std::size_t { kChooseContinue, kChooseRestart };

}  // namespace

VisitorControls::VisitorControls(Host host)
    : host_(std::move(host)), strings_(VisitorStringsFor(host_.language)), kiosk_(host_.kiosk_code) {}

const ui::Card* VisitorControls::card() const {
  const bool has_card = seen_.frame && seen_.frame->visitor && seen_.frame->visitor->card;
  return has_card ? &*seen_.frame->visitor->card : nullptr;
}

void VisitorControls::SetView(Seen seen) {
  seen_ = std::move(seen);
  if (seen_.frame && seen_.frame->visitors_before != visitors_before_) {
    visitors_before_ = seen_.frame->visitors_before;
    CloseMenu();
    lists_route_ = false;
  }
  const bool asks = seen_.frame && seen_.frame->visitor && seen_.frame->visitor->asks_to_continue;
  if (std::exchange(is_asked_, asks) != asks) {
    if (asks) {
      OpenMenu(Menu::kAnew);
    } else {
      CloseMenu();
    }
  }
  const ui::Card* const open = card();
  const std::string entity = open != nullptr ? open->entity : std::string();
  if (entity == turned_entity_) return;
  turned_entity_ = entity;
  turned_rad_.reset();
  dragged_from_px_.reset();
}

void VisitorControls::AddTo(ui::View* view) const {
  ui::Overlay& overlay = view->overlay;
  overlay.points = points_;
  overlay.keyframes = keyframes_;
  overlay.status = status_;
  // Visitors see where sounds are, so that they can ask for them.
  overlay.markers = true;
  if (details_) overlay.visitor.reset();
  if (!overlay.visitor) return;
  ui::VisitorDisplay& visitor = *overlay.visitor;
  if (!status_) {
    visitor.place.clear();
    visitor.route_line.clear();
  }
  visitor.lists_route = lists_route_;
  visitor.has_menu_button = host_.has_route;
  visitor.menu = Choices();
  visitor.chosen = chosen_;
  if (visitor.card) visitor.card->turned_rad = turned_rad_;
}

ui::Overlay VisitorControls::Shown() const {
  ui::View view;
  if (seen_.frame) {
    view.overlay.visitor = seen_.frame->visitor;
    view.overlay.caption = seen_.frame->caption;
    view.overlay.message = seen_.frame->message;
  }
  AddTo(&view);
  return view.overlay;
}

void VisitorControls::Handle(const ui::InputEvent& event, Clock::time_point now) {
  using Kind = ui::InputEvent::Kind;
  if (event.kind == Kind::kKey && !event.repeated) HandleKey(event, now);
  if (event.kind == Kind::kKeyUp && event.key == "space" && std::exchange(held_since_, std::nullopt)) Press();
  if (event.kind == Kind::kClick && event.button == 0) Touch(seen_.pixels_per_unit * event.position);
  if (event.kind == Kind::kRelease && event.button == 0) dragged_from_px_.reset();
}

void VisitorControls::Update(const Eigen::Vector2d& pointer, Clock::time_point now) {
  if (held_since_ && now - *held_since_ >= kLongPress) {
    held_since_.reset();
    PressLong();
  }
  if (!dragged_from_px_) return;
  const Eigen::Vector2d now_px = seen_.pixels_per_unit * pointer;
  const Eigen::Vector2d moved = now_px - std::exchange(dragged_from_px_, now_px).value_or(now_px);
  if (moved.isZero()) return;
  // Across the smaller side of the window, half a turn.
  const double rad_per_px = std::numbers::pi / std::max(1, std::min(seen_.width_px, seen_.height_px));
  Eigen::Vector2d turned = turned_rad_.value_or(Eigen::Vector2d::Zero());
  turned.x() += rad_per_px * moved.x();
  turned.y() = std::clamp(turned.y() - rad_per_px * moved.y(), -kMaxTilt_rad, kMaxTilt_rad);
  turned_rad_ = turned;
  changed_ = true;
}

void VisitorControls::HandleKey(const ui::InputEvent& event, Clock::time_point now) {
  changed_ = true;
  const bool is_kiosk = kiosk_.is_locked();
  if (is_kiosk) closing_ = kiosk_.Add(event.key, now) || closing_;
  if (event.control) {
    if (event.key == "q" && !is_kiosk) closing_ = true;
    return;
  }
  const std::string& key = event.key;
  if (key == "space") held_since_ = now;
  if (key == "enter") {
    if (menu_ != Menu::kNone) {
      Choose(chosen_);
    } else {
      Press();
    }
  }
  if (key == "escape") {
    if (menu_ == Menu::kAnew) {
      Choose(kChooseContinue);
    } else if (menu_ != Menu::kNone) {
      CloseMenu();
    } else if (card() != nullptr) {
      Step(GuideVisitor::Step::kClose);
    }
  }
  if (key == "left" || key == "right" || key == "up" || key == "down") HandleArrow(key);
  if (host_.has_route && !is_asked_) {
    if (key == "m") OpenMenu(Menu::kSteps);
    if (key == "r") OpenMenu(Menu::kAnew);
    if (key == "n") Step(GuideVisitor::Step::kSkip);
    if (key == "b") Step(GuideVisitor::Step::kBack);
    if (key == "l") lists_route_ = !lists_route_;
  }
  if (!is_kiosk) HandleEngineerKey(key);
}

void VisitorControls::HandleEngineerKey(const std::string& key) {
  if (key == "tab" || key == "c") host_.swap_cameras();
  if (key == "f11") host_.toggle_full_screen();
  if (key == "f") host_.toggle_fast_forward();
  if (key == "p") points_ = !points_;
  if (key == "k") keyframes_ = !keyframes_;
  if (key == "h") status_ = !status_;
  if (key == "d") details_ = !details_;
}

void VisitorControls::HandleArrow(const std::string& key) {
  const bool is_back = key == "left" || key == "up";
  if (menu_ != Menu::kNone) {
    const std::size_t count = Choices().size();
    chosen_ = (chosen_ + (is_back ? count - 1 : 1)) % count;
    return;
  }
  const ui::Card* const open = card();
  if (open == nullptr) {
    Step(GuideVisitor::Step::kMark);
    return;
  }
  if (!open->shown) return;
  Eigen::Vector2d turned = turned_rad_.value_or(Eigen::Vector2d::Zero());
  double& angle = key == "left" || key == "right" ? turned.x() : turned.y();
  angle += is_back ? -kArrowTurn_rad : kArrowTurn_rad;
  turned.y() = std::clamp(turned.y(), -kMaxTilt_rad, kMaxTilt_rad);
  turned_rad_ = turned;
}

void VisitorControls::Press() {
  changed_ = true;
  if (menu_ != Menu::kNone) {
    chosen_ = (chosen_ + 1) % Choices().size();
    return;
  }
  Step(GuideVisitor::Step::kPress);
}

void VisitorControls::PressLong() {
  changed_ = true;
  if (menu_ != Menu::kNone) {
    Choose(chosen_);
  } else if (host_.has_route) {
    OpenMenu(Menu::kSteps);
  } else {
    Step(GuideVisitor::Step::kPress);
  }
}

void VisitorControls::OpenMenu(Menu menu) {
  menu_ = menu;
  chosen_ = 0;
  changed_ = true;
}

void VisitorControls::CloseMenu() {
  menu_ = Menu::kNone;
  changed_ = true;
}

std::vector<std::string> VisitorControls::Choices() const {
  switch (menu_) {
    case Menu::kNone:
      break;
    case Menu::kSteps:
      return {strings_.menu_skip, strings_.menu_back, strings_.menu_stops, strings_.menu_anew,
              strings_.menu_close};
    case Menu::kAnew:
      return {strings_.choose_continue, strings_.choose_restart};
  }
  return {};
}

void VisitorControls::Choose(std::size_t choice) {
  const Menu menu = menu_;
  CloseMenu();
  if (menu == Menu::kAnew) {
    if (choice == kChooseRestart) {
      Step(GuideVisitor::Step::kRestart);
    } else if (is_asked_) {
      Step(GuideVisitor::Step::kContinue);
    }
    return;
  }
  if (choice == kChooseSkip) Step(GuideVisitor::Step::kSkip);
  if (choice == kChooseBack) Step(GuideVisitor::Step::kBack);
  if (choice == kChooseStops) lists_route_ = !lists_route_;
  // Since everything that was seen is forgotten, the visitor is asked once more.
  if (choice == kChooseAnew) OpenMenu(Menu::kAnew);
}

void VisitorControls::Touch(const Eigen::Vector2d& point_px) {
  const ui::Overlay shown = Shown();
  if (!shown.visitor) {
    if (seen_.inset.Contains(point_px)) host_.swap_cameras();
    return;
  }
  const ui::MenuLayout menu = ui::LayOutMenu(*shown.visitor, seen_.width_px, seen_.height_px, seen_.style);
  if (menu_ != Menu::kNone) {
    for (std::size_t i = 0; i < menu.choices.size(); ++i) {
      if (menu.choices[i].Contains(point_px)) return Choose(i);
    }
    // A hand that takes up the device answers nothing.
    return is_asked_ ? void() : CloseMenu();
  }
  if (card() != nullptr) return TouchCard(point_px);
  if (menu.button.Contains(point_px)) {
    return OpenMenu(Menu::kSteps);
  }
  if (seen_.inset.Contains(point_px)) return host_.swap_cameras();
  // Half a fingertip beside a thing is meant for it.
  const double margin_px = 0.5 * seen_.style.target_px / seen_.box.scale;
  const ui::CardTarget* const target =
      ui::TargetAt(seen_.targets, seen_.box.ImageFromWindow(point_px), margin_px);
  if (target != nullptr) Step(GuideVisitor::Step::kOpen, target->entity);
}

void VisitorControls::TouchCard(const Eigen::Vector2d& point_px) {
  const ui::CardLayout layout = ui::LayOutCard(Shown(), seen_.width_px, seen_.height_px, seen_.style);
  if (layout.close.Contains(point_px)) return Step(GuideVisitor::Step::kClose);
  if (card()->shown && layout.shown.Contains(point_px)) {
    dragged_from_px_ = point_px;
    return;
  }
  if (layout.card.Contains(point_px)) Step(GuideVisitor::Step::kPress);
}

}  // namespace docent::app

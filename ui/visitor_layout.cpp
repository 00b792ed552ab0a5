// SPDX-License-Identifier: Apache-2.0
#include "ui/visitor_layout.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace docent::ui {

namespace {

constexpr double kCapitalRatio = 0.7;  // Height of a capital letter over the em, of common sans-serif fonts.

// The longest choice of a menu, in any language, needs less.
constexpr double kChoiceUnits = 360;

// The side of what is touched; also where the size of a millimetre is not known.
double TouchTarget(const HeadsUpStyle& style) {
  constexpr double kLeastUnits = 30;
  return std::max(style.target_px, kLeastUnits * style.unit_px);
}

// What the caption and the message need at most.
double RoomBelow(const Overlay& overlay, const HeadsUpStyle& style) {
  return style.unit_px * ((overlay.caption.empty() ? 0 : 90) + (overlay.message.empty() ? 0 : 60));
}

}  // namespace

double VisitorUnit_px(int width_px, int height_px, double pixels_per_mm) {
  const double side = std::min(width_px, height_px);
  const double letter_mm =
      2 * kReadingDistance_mm * std::tan(0.5 * kLeastLetter_deg * std::numbers::pi / 180);
  const double legible = letter_mm / kCapitalRatio * pixels_per_mm / kNormalTextUnits;
  // A window with fewer than 300 units would have no room for a sentence.
  return std::clamp(std::max(side / 480, std::min(legible, side / 300)), 0.5, 6.0);
}

CardLayout LayOutCard(const Overlay& overlay, int width_px, int height_px, const HeadsUpStyle& style) {
  CardLayout layout;
  if (!overlay.visitor || !overlay.visitor->card) return layout;
  const VisitorDisplay& visitor = *overlay.visitor;
  const Card& card = *visitor.card;
  const double unit = style.unit_px, margin = 10 * unit, padding = 14 * unit, target = TouchTarget(style);
  layout.card = {margin, margin, std::max(1.0, width_px - 2 * margin),
                 std::max(1.0, height_px - 2 * margin - style.bottom_px - RoomBelow(overlay, style))};
  const Area& all = layout.card;
  const double edge = 0.5 * padding;
  layout.close = {visitor.is_right_to_left ? all.x + edge : all.right() - target - edge, all.y + edge, target,
                  target};
  const double hint_height = card.hint.empty() ? 0 : 30 * unit;
  Area inside{all.x + padding, all.y + padding, std::max(1.0, all.width - 2 * padding),
              std::max(1.0, all.height - 2 * padding - hint_height)};
  layout.hint = {inside.x, inside.bottom(), inside.width, hint_height};
  const bool is_wide = width_px > height_px;
  if (card.text.empty()) {
    layout.shown = inside;
    return layout;
  }
  // Few words need no more than the lower part, and leave the room in view.
  constexpr std::size_t kFewBytes = 140;
  if (!card.shown && card.text.size() <= kFewBytes) {
    const double cut =
        std::max(0.0, all.height - std::max(0.38 * std::min(width_px, height_px), target + 120 * unit));
    layout.card.y += cut;
    layout.card.height -= cut;
    layout.close.y += cut;
    inside.y += cut;
    inside.height -= cut;
  }
  // The text keeps clear of the button, which stands in a corner of the half with the text or above it.
  const double beside = target + edge;
  if (!card.shown) {
    layout.text = {inside.x + (visitor.is_right_to_left ? beside : 0), inside.y, inside.width - beside,
                   inside.height};
    return layout;
  }
  if (is_wide) {
    const double half = 0.5 * (inside.width - padding);
    layout.shown = {visitor.is_right_to_left ? inside.x + half + padding : inside.x, inside.y, half,
                    inside.height};
    layout.text = {visitor.is_right_to_left ? inside.x + beside : inside.x + half + padding, inside.y,
                   half - beside, inside.height};
    return layout;
  }
  const double upper = 0.55 * inside.height;
  layout.shown = {inside.x, inside.y, inside.width, upper};
  layout.text = {inside.x, inside.y + upper + padding, inside.width, inside.height - upper - padding};
  return layout;
}

MenuLayout LayOutMenu(const VisitorDisplay& visitor, int width_px, int height_px, const HeadsUpStyle& style) {
  MenuLayout layout;
  const double unit = style.unit_px, target = TouchTarget(style), margin = 10 * unit;
  // At the edge where a thumb is, above the sentences.
  if (visitor.has_menu_button)
    layout.button = {visitor.is_right_to_left ? width_px - margin - target : margin,
                     0.62 * height_px - 0.5 * target, target, target};
  const double gap = 8 * unit, height = std::max(target, 40 * unit);
  const auto count = static_cast<double>(visitor.menu.size());
  const double width = std::min(width_px - 2 * margin, std::max(0.5 * width_px, kChoiceUnits * unit));
  double y = 0.5 * (height_px - count * height - (count - 1) * gap);
  for (std::size_t i = 0; i < visitor.menu.size(); ++i) {
    layout.choices.push_back({0.5 * (width_px - width), y, width, height});
    y += height + gap;
  }
  return layout;
}

}  // namespace docent::ui

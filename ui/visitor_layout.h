// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "ui/heads_up.h"
#include "ui/window_layout.h"

// Where the things are that a visitor touches, in pixels of the canvas. Pure functions; any thread.
namespace docent::ui {

// What is touched is at least this large: the width of a fingertip (ISO 9241-9 and MIL-STD-1472 have
// similar limits).
inline constexpr double kTouchTarget_mm = 9;
// The height of a capital letter at the reading distance below is at least 0.4 degrees (ISO 9241-303
// recommends 20 to 22 minutes of arc and takes 16 as the limit).
inline constexpr double kLeastLetter_deg = 0.4;
inline constexpr double kReadingDistance_mm = 400;  // Of a tablet in the hand.
inline constexpr double kNormalTextUnits = 15;      // Of a text of normal size; see HeadsUpStyle.

// Pixels of the canvas per unit, of which a normal text has 15, for a display of this size: texts grow with
// it and are legible at the reading distance, as far as the display is large enough for that.
double VisitorUnit_px(int width_px, int height_px, double pixels_per_mm);

// A card and its parts; parts that it does not have are empty. Below it is room for the caption and the
// message.
struct CardLayout {
  Area card;
  Area close;  // The button that closes it.
  Area shown;  // The model or image.
  Area text, hint;
};
CardLayout LayOutCard(const Overlay& overlay, int width_px, int height_px, const HeadsUpStyle& style);

// The button of the menu, and the choices while it is open, in their order.
struct MenuLayout {
  Area button;
  std::vector<Area> choices;
};
MenuLayout LayOutMenu(const VisitorDisplay& visitor, int width_px, int height_px, const HeadsUpStyle& style);

}  // namespace docent::ui

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "ui/text.h"

// The colours of the window, of its panel as well as of the texts over the image. Any thread, except
// ApplyTheme.
namespace docent::ui::theme {

// Grounds. Texts over the image stand on kHeadsUp, through which the image is seen.
inline constexpr Color kPanel{0.098f, 0.114f, 0.137f, 1.0f};
inline constexpr Color kField{0.161f, 0.184f, 0.220f, 1.0f};
inline constexpr Color kFieldHovered{0.196f, 0.227f, 0.275f, 1.0f};
inline constexpr Color kButton{0.173f, 0.286f, 0.400f, 1.0f};
inline constexpr Color kButtonHovered{0.192f, 0.337f, 0.478f, 1.0f};
inline constexpr Color kButtonActive{0.145f, 0.247f, 0.349f, 1.0f};
inline constexpr Color kSelectedRow{0.212f, 0.318f, 0.420f, 1.0f};
inline constexpr Color kError{0.329f, 0.098f, 0.102f, 1.0f};
inline constexpr Color kDone{0.098f, 0.227f, 0.161f, 1.0f};
inline constexpr Color kHeadsUp{0.05f, 0.07f, 0.10f, 0.78f};
// Boards of signposts, and the strip with the name of the map that one leads to.
inline constexpr Color kSignBoard{0.086f, 0.173f, 0.275f, 1.0f};
inline constexpr Color kSignStrip{1.0f, 0.769f, 0.353f, 1.0f};
// Texts and lines.
inline constexpr Color kText{0.953f, 0.957f, 0.945f, 1.0f};
inline constexpr Color kSignText{0.97f, 0.96f, 0.92f, 1.0f};
inline constexpr Color kSignStripText{0.04f, 0.08f, 0.13f, 1.0f};
inline constexpr Color kMutedText{0.690f, 0.733f, 0.776f, 1.0f};
inline constexpr Color kAccentText{1.0f, 0.796f, 0.420f, 1.0f};
inline constexpr Color kBorder{0.290f, 0.333f, 0.392f, 1.0f};
inline constexpr Color kSelection{1.0f, 0.737f, 0.239f, 1.0f};  // Outline of what is selected.
inline constexpr Color kGood{0.36f, 0.85f, 0.51f, 1.0f}, kFair{1.0f, 0.76f, 0.25f, 1.0f},
    kPoor{1.0f, 0.42f, 0.36f, 1.0f};
// Axes of the gizmo: right, up and front of an entity.
inline constexpr Color kAxisRight{1.0f, 0.40f, 0.38f, 1.0f}, kAxisUp{0.45f, 0.88f, 0.45f, 1.0f},
    kAxisFront{0.45f, 0.68f, 1.0f, 1.0f};

// A text colour and a ground that it stands on somewhere in the window.
struct TextOnGround {
  const char* where;
  Color text, ground;
  // WCAG 2.1: 4.5 (AA) in the author's window, 7 (AAA) for visitors, who read in any light.
  double least_contrast = 4.5;
};
// All such pairs. A ground that is not opaque is given as it looks over a white image, the worst case.
std::span<const TextOnGround> TextPairs();

// `over` as it looks on an opaque ground.
Color Blend(const Color& over, const Color& ground);
// The contrast ratio of two opaque sRGB colours, 1 to 21 (WCAG 2.1, "contrast ratio").
double ContrastRatio(const Color& a, const Color& b);

// Sets the colours and sizes of the current Dear ImGui context. `scale` is the size of the interface relative
// to the one on a monitor of 96 dpi. On the window's thread.
void ApplyTheme(double scale);

}  // namespace docent::ui::theme

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <string_view>

namespace docent::ui {

// sRGB, 0..1, not premultiplied.
struct Color {
  float red = 1, green = 1, blue = 1, alpha = 1;
};

struct TextStyle {
  double size_px = 16;  // Height of the font's em.
  bool bold = false;
  bool centered = false;    // Centres each line within the block.
  int max_width_px = 600;   // Longer lines are wrapped.
  int max_height_px = 400;  // Text that does not fit is cut off with an ellipsis.
  Color color;

  bool operator==(const TextStyle& other) const;
};

// Converts any bytes to displayable text: valid UTF-8, in which broken sequences become the replacement
// character and control characters other than line ends become spaces. Text longer than max_bytes is cut off
// with an ellipsis.
std::string ReadableText(std::string_view text, std::size_t max_bytes = 4096);

// Renders text with Pango to a CV_8UC4 image (BGRA, premultiplied alpha) that is as large as the text, at
// least 1x1 and at most max_width_px by max_height_px. The text is passed through ReadableText first.
// A line begins at the right if most of its letters run from right to left, whatever it begins with; one
// without letters, if most of those of the text do.
// *is_cut, if not null, is set to whether part of the text was left out.
cv::Mat DrawText(std::string_view text, const TextStyle& style, bool* is_cut = nullptr);

}  // namespace docent::ui

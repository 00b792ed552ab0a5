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
  double size_px = 16;  // height of the font's em
  bool bold = false;
  bool centered = false;    // each line within the block
  int max_width_px = 600;   // lines wrap there
  int max_height_px = 400;  // what does not fit is cut and ends with an ellipsis
  Color color;

  bool operator==(const TextStyle& other) const;
};

// What may be shown of any bytes: valid UTF-8 (broken sequences become the replacement character), control
// characters other than line ends become spaces, at most max_bytes long.
std::string ReadableText(std::string_view text, std::size_t max_bytes = 4096);

// Sets text with Pango. CV_8UC4, blue first, premultiplied alpha, just as large as the text, at most
// max_width_px by max_height_px, at least 1x1. Whatever the text is, ReadableText of it is set. is_cut, if
// not null, says whether something had to be left out.
cv::Mat DrawText(std::string_view text, const TextStyle& style, bool* is_cut = nullptr);

}  // namespace docent::ui

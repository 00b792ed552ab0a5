// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>

namespace docent::ui {

// The rectangle of the main image, in its pixels, that shows the second camera's image. It lies in the upper
// right corner.
struct Inset {
  int x = 0, y = 0, width = 0, height = 0;

  bool Contains(const Eigen::Vector2d& pixel) const {
    return pixel.x() >= x && pixel.y() >= y && pixel.x() < x + width && pixel.y() < y + height;
  }
};

// All sizes are positive. The small image keeps its aspect ratio.
inline Inset PlaceInset(int width_px, int height_px, int small_width_px, int small_height_px) {
  constexpr double kShare = 0.28, kMargin = 0.015;  // Ratios of the main image's width.
  Inset inset;
  inset.width = std::max(1, static_cast<int>(kShare * width_px));
  inset.height = std::clamp(inset.width * small_height_px / small_width_px, 1, height_px);
  const int margin = static_cast<int>(kMargin * width_px);
  inset.x = std::max(0, width_px - inset.width - margin);
  inset.y = std::min(margin, height_px - inset.height);
  return inset;
}

}  // namespace docent::ui

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace docent::ui {

// Where an image lies in a window that shows it as large as fits, undistorted and in the middle. Window
// coordinates have their origin at the top left, y down.
struct Letterbox {
  int x = 0, y = 0, width = 1, height = 1;  // of the image, in the window's units
  double scale = 1;                         // window units an image pixel

  // The image's pixel under a point of the window (0, 0 is the window's top-left corner, not its first
  // pixel's centre); outside the image when it lies beside it.
  Eigen::Vector2d ImageFromWindow(const Eigen::Vector2d& point) const {
    return (point - Eigen::Vector2d(x, y)) / scale - Eigen::Vector2d(0.5, 0.5);
  }
};

// All sizes positive.
inline Letterbox FitImage(int image_width, int image_height, int window_width, int window_height) {
  Letterbox box;
  box.scale = std::min(static_cast<double>(window_width) / image_width,
                       static_cast<double>(window_height) / image_height);
  box.width = std::max(1, static_cast<int>(std::lround(image_width * box.scale)));
  box.height = std::max(1, static_cast<int>(std::lround(image_height * box.scale)));
  box.x = (window_width - box.width) / 2;
  box.y = (window_height - box.height) / 2;
  return box;
}

}  // namespace docent::ui

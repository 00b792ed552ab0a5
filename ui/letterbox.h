// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "ui/window_layout.h"

namespace docent::ui {

// The position of an image in a window that shows it centred, undistorted and as large as fits. Window
// coordinates have their origin at the top left, y down.
struct Letterbox {
  int x = 0, y = 0, width = 1, height = 1;  // The image's rectangle in window units.
  double scale = 1;                         // Window units per image pixel.

  // The image pixel at a point of the window, where (0, 0) is the window's top-left corner and not the centre
  // of its first pixel. The result lies outside the image when the point is on the border.
  Eigen::Vector2d ImageFromWindow(const Eigen::Vector2d& point) const {
    return (point - Eigen::Vector2d(x, y)) / scale - Eigen::Vector2d(0.5, 0.5);
  }
  // The inverse of ImageFromWindow.
  Eigen::Vector2d WindowFromImage(const Eigen::Vector2d& pixel) const {
    return scale * (pixel + Eigen::Vector2d(0.5, 0.5)) + Eigen::Vector2d(x, y);
  }
};

// All sizes are positive.
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

// The same in a part of the window.
inline Letterbox FitImage(int image_width, int image_height, const Area& area) {
  Letterbox box = FitImage(image_width, image_height, std::max(1, static_cast<int>(area.width)),
                           std::max(1, static_cast<int>(area.height)));
  box.x += static_cast<int>(area.x);
  box.y += static_cast<int>(area.y);
  return box;
}

}  // namespace docent::ui

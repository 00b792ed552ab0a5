// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

// Where the parts of the author's window are. Pure functions; any thread.
namespace docent::ui {

// A rectangle of a window in window units, with its origin at the top left, y down.
struct Area {
  double x = 0, y = 0, width = 0, height = 0;

  double right() const { return x + width; }
  double bottom() const { return y + height; }
  bool Contains(const Eigen::Vector2d& point) const {
    return point.x() >= x && point.x() < right() && point.y() >= y && point.y() < bottom();
  }
};

// The parts do not overlap: the image with everything that is drawn over it keeps to the left of the panel.
struct WindowLayout {
  double scale = 1;  // Of the interface; 1 on a monitor of 96 dpi.
  bool panel_open = true;
  Area image;  // The image is shown centred in it.
  Area panel;  // At the right edge; a narrow strip with a button when the panel is closed.
};

// The smallest window that the interface is made for, at a scale of 1.
inline constexpr double kMinWindowWidth = 640, kMinWindowHeight = 400;

// `wanted_scale` is reduced where a window is too small for it, down to 0.75: smaller texts are not readable.
// Sizes are at least 1; in a window below 480 by 300 units, less than half of it is left to the image.
WindowLayout LayOutWindow(double width, double height, double wanted_scale, bool panel_open);

// Where a small map lies over an image: in its upper right corner, below the second camera's image (empty
// without one). Empty where it would be too small to be read.
Area PlaceSmallMap(const Area& shown_image, const Area& inset, double scale);

}  // namespace docent::ui

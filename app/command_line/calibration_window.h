// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "app/calibration/calibrate.h"
#include "ui/renderer.h"
#include "ui/window.h"

namespace docent::app {

// What the person who holds the board sees: the image with the board's corners in it, where in the image
// corners have been (shaded cells), how far each of them is from where the lens so far puts it (lines, thirty
// times as long), and one sentence on what is missing. On the main thread (GLFW's rule).
class CalibrationWindow {
 public:
  struct Shown {
    cv::Mat image;                // CV_8UC1 or CV_8UC3
    BoardView now;                // the board in it; without points where there is none
    std::vector<BoardView> kept;  // the views so far
    // By view as many as were kept when the lens was last worked out, and corner: where the lens puts it,
    // minus where it is, pixels.
    std::vector<std::vector<Eigen::Vector2d>> residuals;
    std::string message;
  };

  // Throws Error when there is no display.
  CalibrationWindow(int width_px, int height_px) : window_("Docent - calibrate", width_px, height_px) {}
  // False when the person is done: closed the window, or pressed enter, escape or q.
  bool Show(const Shown& shown, const Coverage& coverage);

 private:
  ui::Window window_;
  ui::Renderer renderer_;
};

// The drawing alone, CV_8UC3.
cv::Mat PaintCalibration(const CalibrationWindow::Shown& shown, const Coverage& coverage);

}  // namespace docent::app

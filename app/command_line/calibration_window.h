// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "app/calibration/calibrate.h"
#include "ui/renderer.h"
#include "ui/window.h"

namespace docent::app {

// Window for the person who holds the calibration board. It shows the image with the detected corners, the
// image cells covered by earlier views (shaded), the residual of each corner for the current lens estimate
// (lines, scaled by 30), and one sentence about what is missing. Main thread only, as GLFW requires.
class CalibrationWindow {
 public:
  struct Shown {
    cv::Mat image;                // CV_8UC1 or CV_8UC3
    BoardView now;                // Board detected in the image; without points when there is none.
    std::vector<BoardView> kept;  // All views kept so far.
    // Residuals, predicted minus detected corner, in pixels: one entry for each view that was kept when the
    // lens was last estimated, with one residual for each corner.
    std::vector<std::vector<Eigen::Vector2d>> residuals;
    std::string message;
  };

  enum class Answer {
    kGoOn,
    kFinish,  // Enter: the views are sufficient.
    kCancel,  // Escape, q, or the window was closed.
  };

  // Sizes in pixels. Throws Error when there is no display.
  CalibrationWindow(int width_px, int height_px) : window_("Docent - calibrate", width_px, height_px) {}
  // Returns what the person wants.
  Answer Show(const Shown& shown, const Coverage& coverage);

 private:
  ui::Window window_;
  ui::Renderer renderer_;
};

// Draws the window's image (CV_8UC3) without a window.
cv::Mat PaintCalibration(const CalibrationWindow::Shown& shown, const Coverage& coverage);

}  // namespace docent::app

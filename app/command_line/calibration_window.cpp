// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/calibration_window.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace docent::app {

namespace {

// OpenCV draws in units of 2^-kShift pixels, so that lines move smoothly.
constexpr int kShift = 4;

cv::Point Place(const Eigen::Vector2d& pixel) {
  return {cvRound(pixel.x() * (1 << kShift)), cvRound(pixel.y() * (1 << kShift))};
}

void ShadeCells(const Coverage& coverage, cv::Mat* image) {
  cv::Mat shade = image->clone();
  for (int row = 0; row < Coverage::kRows; ++row) {
    for (int column = 0; column < Coverage::kColumns; ++column) {
      if (!coverage.IsSeen(column, row)) continue;
      const cv::Point low(column * image->cols / Coverage::kColumns, row * image->rows / Coverage::kRows);
      const cv::Point high((column + 1) * image->cols / Coverage::kColumns,
                           (row + 1) * image->rows / Coverage::kRows);
      cv::rectangle(shade, low, high, {80, 160, 80}, cv::FILLED);
    }
  }
  constexpr double kShade = 0.25;
  cv::addWeighted(shade, kShade, *image, 1 - kShade, 0, *image);
}

// Green to red with increasing residual, scaled to an image width of 640: red from 0.6 px.
cv::Scalar ColorOf(double residual_px, int width_px) {
  const double poor = std::clamp(residual_px * 640 / width_px / 0.6, 0.0, 1.0);
  return {60, 60 + 160 * (1 - poor), 60 + 195 * poor};
}

}  // namespace

cv::Mat PaintCalibration(const CalibrationWindow::Shown& shown, const Coverage& coverage) {
  cv::Mat drawn;
  shown.image.channels() == 1 ? cv::cvtColor(shown.image, drawn, cv::COLOR_GRAY2BGR)
                              : shown.image.copyTo(drawn);
  ShadeCells(coverage, &drawn);
  constexpr double kResidualScale = 30;
  for (std::size_t i = 0; i < shown.kept.size(); ++i) {
    for (std::size_t k = 0; k < shown.kept[i].pixels.size(); ++k) {
      const Eigen::Vector2d& pixel = shown.kept[i].pixels[k];
      if (i >= shown.residuals.size()) {
        cv::circle(drawn, Place(pixel), 1 << kShift, {200, 200, 200}, cv::FILLED, cv::LINE_AA, kShift);
        continue;
      }
      const Eigen::Vector2d& residual = shown.residuals[i][k];
      const cv::Scalar color = ColorOf(residual.norm(), drawn.cols);
      cv::circle(drawn, Place(pixel), 1 << kShift, color, cv::FILLED, cv::LINE_AA, kShift);
      cv::line(drawn, Place(pixel), Place(pixel + kResidualScale * residual), color, 1, cv::LINE_AA, kShift);
    }
  }
  for (const Eigen::Vector2d& pixel : shown.now.pixels)
    cv::circle(drawn, Place(pixel), 4 << kShift, {60, 190, 255}, 2, cv::LINE_AA, kShift);
  return drawn;
}

CalibrationWindow::Answer CalibrationWindow::Show(const Shown& shown, const Coverage& coverage) {
  for (const ui::InputEvent& event : window_.PollEvents()) {
    if (event.kind != ui::InputEvent::Kind::kKey) continue;
    if (event.key == "enter") return Answer::kFinish;
    if (event.key == "escape" || event.key == "q") return Answer::kCancel;
  }
  if (window_.IsClosing()) return Answer::kCancel;
  engine::TrackedFrame frame;
  frame.frame.image = PaintCalibration(shown, coverage);
  frame.state = engine::TrackingState::kDropped;  // Hides the hints for initialization and for a lost camera.
  ui::View view;
  view.overlay.status = false;
  view.tracked = &frame;
  view.overlay.message = shown.message;
  renderer_.Draw(view);
  const Eigen::Vector2i size = window_.FramebufferSize();
  renderer_.Present(std::max(1, size.x()), std::max(1, size.y()));
  window_.Show();
  return Answer::kGoOn;
}

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

namespace docent::app {

// Reads what a virtual screen shows, as a person does: where a text of the author's panel is, and where
// something has a colour.
class ScreenReader {
 public:
  // `folder` holds the framebuffer of the screen; see VirtualScreen.
  explicit ScreenReader(std::filesystem::path folder) : folder_(std::move(folder)) {}

  // The screen at present, CV_8UC3 in BGR; empty if it cannot be read.
  cv::Mat Capture() const;
  // The middle of a text in this part of the screen, in pixels of the screen, where it is drawn with the
  // panel's font; empty if it is not shown. `margin_px` on its left and right have to be empty, so that a
  // word is not found within a longer text.
  std::optional<cv::Point> Find(const std::string& text, const cv::Rect& part, int margin_px = 0) const;

 private:
  const std::filesystem::path folder_;
};

// The middle of what has this colour (BGR) in `now` and had another one `before`, in pixels; empty if it is
// smaller than 30 pixels.
std::optional<cv::Point2d> FindNewColor(const cv::Mat& before, const cv::Mat& now, const cv::Scalar& color);

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>

namespace docent::ui {

// The grey level of a pixel of a CV_8UC1 or CV_8UC3 (BGR) image, as cv::cvtColor computes it.
inline int GrayLevel(const cv::Mat& image, int x, int y) {
  if (image.type() == CV_8UC1) return image.at<std::uint8_t>(y, x);
  const auto& bgr = image.at<cv::Vec3b>(y, x);
  return (1868 * bgr[0] + 9617 * bgr[1] + 4899 * bgr[2] + 8192) >> 14;
}

}  // namespace docent::ui

// SPDX-License-Identifier: Apache-2.0
#include "engine/vision/image_pyramid.h"

#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/core/hal/intrin.hpp>

namespace docent::engine {

namespace {

// Sums of eight pairs of neighbours.
cv::v_uint16x8 PairSums(const std::uint8_t* pixels) {
  const cv::v_uint16x8 pairs = cv::v_reinterpret_as_u16(cv::v_load(pixels));
  return (pairs & cv::v_setall_u16(0xFF)) + (pairs >> 8);
}

}  // namespace

void HalveImage(const cv::Mat& image, cv::Mat* half) {
  CV_Assert(image.type() == CV_8UC1);
  half->create(image.rows / 2, image.cols / 2, CV_8UC1);
  const cv::v_uint16x8 rounding = cv::v_setall_u16(2);
  for (int y = 0; y < half->rows; ++y) {
    const std::uint8_t* upper = image.ptr<std::uint8_t>(2 * y);
    const std::uint8_t* lower = image.ptr<std::uint8_t>(2 * y + 1);
    std::uint8_t* out = half->ptr<std::uint8_t>(y);
    int x = 0;
    for (; x + 8 <= half->cols; x += 8) {
      const cv::v_uint16x8 sums = PairSums(upper + 2 * x) + PairSums(lower + 2 * x) + rounding;
      cv::v_pack_store(out + x, sums >> 2);
    }
    for (; x < half->cols; ++x) {
      const int sum = upper[2 * x] + upper[2 * x + 1] + lower[2 * x] + lower[2 * x + 1];
      out[x] = static_cast<std::uint8_t>((sum + 2) / 4);
    }
  }
}

}  // namespace docent::engine

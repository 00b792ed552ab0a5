// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>

#include "engine/base/random.h"

namespace docent::engine {

// An image for tests, CV_8UC1, every pixel of which has an independent, uniformly distributed grey value.
inline cv::Mat NoiseImage(int width_px, int height_px, std::uint64_t seed) {
  Random random(seed);
  cv::Mat image(height_px, width_px, CV_8UC1);
  for (int y = 0; y < height_px; ++y)
    for (int x = 0; x < width_px; ++x)
      image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(random.Below(256));
  return image;
}

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/texture.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace docent::app {
namespace {

// Spreads the bytes b g r 0 to the 16-bit lanes b r g 0.
std::uint64_t Spread(std::uint32_t texel) {
  return (texel & 0x00FF00FFu) | std::uint64_t{texel >> 8 & 0x00FF00FFu} << 32;
}

// weight is in [0, 256].
std::uint64_t Blend(std::uint64_t a, std::uint64_t b, unsigned weight) {
  return (a * (256 - weight) + b * weight + 0x0080008000800080ull) >> 8 & 0x00FF00FF00FF00FFull;
}

}  // namespace

Texture::Texture(const cv::Mat& bgr, bool repeat) : repeat_(repeat) {
  if (bgr.type() != CV_8UC3 || !std::has_single_bit(static_cast<unsigned>(bgr.cols)) ||
      !std::has_single_bit(static_cast<unsigned>(bgr.rows))) {
    throw std::invalid_argument("a texture must be a CV_8UC3 image whose sides are powers of two");
  }
  cv::Mat image = bgr;
  while (true) {
    Level level;
    level.width = image.cols;
    level.height = image.rows;
    level.texels.reserve(static_cast<std::size_t>(image.cols) * image.rows);
    for (int y = 0; y < image.rows; ++y) {
      const cv::Vec3b* row = image.ptr<cv::Vec3b>(y);
      for (int x = 0; x < image.cols; ++x) {
        level.texels.push_back(row[x][0] | static_cast<std::uint32_t>(row[x][1]) << 8 |
                               static_cast<std::uint32_t>(row[x][2]) << 16);
      }
    }
    levels_.push_back(std::move(level));
    if (image.cols == 1 && image.rows == 1) break;
    cv::Mat half;
    cv::resize(image, half, {std::max(1, image.cols / 2), std::max(1, image.rows / 2)}, 0, 0, cv::INTER_AREA);
    image = half;
  }
}

inline std::uint64_t Texture::SampleLevel(const Level& level, std::int64_t x_q16, std::int64_t y_q16) const {
  const unsigned weight_x = static_cast<unsigned>(x_q16 >> 8 & 255);
  const unsigned weight_y = static_cast<unsigned>(y_q16 >> 8 & 255);
  int x0 = static_cast<int>(x_q16 >> 16), y0 = static_cast<int>(y_q16 >> 16);
  int x1 = x0 + 1, y1 = y0 + 1;
  if (x0 < 0 || y0 < 0 || x1 >= level.width || y1 >= level.height) {
    if (repeat_) {
      x0 &= level.width - 1, x1 &= level.width - 1;
      y0 &= level.height - 1, y1 &= level.height - 1;
    } else {
      x0 = std::clamp(x0, 0, level.width - 1), x1 = std::clamp(x1, 0, level.width - 1);
      y0 = std::clamp(y0, 0, level.height - 1), y1 = std::clamp(y1, 0, level.height - 1);
    }
  }
  const std::uint32_t* row0 = level.texels.data() + static_cast<std::ptrdiff_t>(y0) * level.width;
  const std::uint32_t* row1 = level.texels.data() + static_cast<std::ptrdiff_t>(y1) * level.width;
  return Blend(Blend(Spread(row0[x0]), Spread(row0[x1]), weight_x),
               Blend(Spread(row1[x0]), Spread(row1[x1]), weight_x), weight_y);
}

std::uint64_t Texture::Sample(float x, float y, int level_q8) const {
  const int top = static_cast<int>(levels_.size()) - 1;
  level_q8 = std::clamp(level_q8, 0, top * 256);
  const int level = level_q8 >> 8;
  const auto x_q16 = static_cast<std::int64_t>(x * 65536.0f), y_q16 = static_cast<std::int64_t>(y * 65536.0f);
  // Texel k of a level covers the texels [k 2^level, (k+1) 2^level) of level 0; its colour is that of their
  // centre.
  constexpr std::int64_t kHalf = 1 << 15;
  const std::uint64_t fine = SampleLevel(levels_[level], (x_q16 >> level) - kHalf, (y_q16 >> level) - kHalf);
  const unsigned weight = level_q8 & 255;
  if (weight == 0) return fine;
  const int next = level + 1;
  return Blend(fine, SampleLevel(levels_[next], (x_q16 >> next) - kHalf, (y_q16 >> next) - kHalf), weight);
}

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace docent::app {

// A colour image with its mip pyramid (Williams 1983). Immutable; any thread. Sides are powers of two, so
// that wrapping is a bit mask. All channels are interpolated together as 16-bit lanes of one 64-bit word, so
// a sample costs about as much as three table lookups.
class Texture {
 public:
  // bgr: CV_8UC3, both sides powers of two (checked). repeat: the texture repeats; otherwise its border is
  // extended.
  Texture(const cv::Mat& bgr, bool repeat);

  int width() const { return levels_.front().width; }
  int height() const { return levels_.front().height; }

  // Colour at texel coordinates (x, y) of level 0, where texel (0, 0) covers [0, 1) x [0, 1).
  // level_q8: mip level in units of 1/256, clamped to the existing levels; trilinear interpolation.
  // The result's 16-bit lanes are b, r, g and unused, from the lowest: see Blue, Green, Red.
  std::uint64_t Sample(float x, float y, int level_q8) const;

  static int Blue(std::uint64_t lanes) { return static_cast<int>(lanes & 0xFFFF); }
  static int Red(std::uint64_t lanes) { return static_cast<int>(lanes >> 16 & 0xFFFF); }
  static int Green(std::uint64_t lanes) { return static_cast<int>(lanes >> 32 & 0xFFFF); }

 private:
  struct Level {
    int width = 0, height = 0;
    std::vector<std::uint32_t> texels;  // b, g, r, 0 from the lowest byte
  };
  // Coordinates are in 1/65536 of this level's texels and refer to the upper left of the four blended texels.
  std::uint64_t SampleLevel(const Level& level, std::int64_t x_q16, std::int64_t y_q16) const;

  std::vector<Level> levels_;
  bool repeat_ = false;
};

}  // namespace docent::app

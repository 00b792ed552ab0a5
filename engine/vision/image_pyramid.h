// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "engine/vision/small_blurry_image.h"

namespace docent::engine {

inline constexpr int kPyramidLevels = 4;  // ptamm §2.1

// Pixel of level 0 that a pixel of a level stands for, with pixel centres at integers: level l halves the
// image l times, and each of its pixels covers 2^l by 2^l pixels of level 0.
inline Eigen::Vector2d LevelZeroFromLevel(const Eigen::Vector2d& pixel, int level) {
  const double scale = 1 << level;
  return (pixel.array() + 0.5) * scale - 0.5;
}
inline Eigen::Vector2d LevelFromLevelZero(const Eigen::Vector2d& pixel, int level) {
  const double scale = 1.0 / (1 << level);
  return (pixel.array() + 0.5) * scale - 0.5;
}

// 2x2 means, rounded. An odd last row or column is left out: it would stretch every pixel a little beyond
// 2x2. *half keeps its memory when its size is the same.
void HalveImage(const cv::Mat& image, cv::Mat* half);

// A FAST corner of one level, at whole pixels of that level.
struct Corner {
  std::int16_t x = 0, y = 0;
};

// Images that a ImageStore keeps.
class KeptImages {
 public:
  virtual ~KeptImages() = default;
  // See ImageFeatures::Look. Any thread.
  virtual void Look() const = 0;
};

// Everything of one image that tracking and mapping look at. Level 0 is the full grey image (CV_8UC1),
// each further level half the size (2x2 mean). Corners are sorted by row, then column.
struct ImageFeatures {
  std::array<cv::Mat, kPyramidLevels> levels;
  std::array<std::vector<Corner>, kPyramidLevels> corners;
  // row_begin[l][y] is the index of the first corner of level l at row y or below; has rows + 1 entries.
  std::array<std::vector<int>, kPyramidLevels> row_begin;
  std::array<int, kPyramidLevels> fast_threshold{};
  SmallBlurryImage small_blurry;
  std::shared_ptr<const KeptImages> kept;  // null where the levels lie in ordinary memory

  // Says that the levels are about to be read, so that a store lets others rest. Whoever goes from keyframe
  // to keyframe says so for each; it costs next to nothing, and who forgets it reads the same pixels.
  void Look() const {
    if (kept) kept->Look();
  }
};

}  // namespace docent::engine

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

// Level-0 pixel of a pixel of another level, with pixel centres at integers: level l halves the image l
// times, and each of its pixels covers 2^l by 2^l pixels of level 0.
inline Eigen::Vector2d LevelZeroFromLevel(const Eigen::Vector2d& pixel, int level) {
  const double scale = 1 << level;
  return (pixel.array() + 0.5) * scale - 0.5;
}
inline Eigen::Vector2d LevelFromLevelZero(const Eigen::Vector2d& pixel, int level) {
  const double scale = 1.0 / (1 << level);
  return (pixel.array() + 0.5) * scale - 0.5;
}

// Means of 2x2 pixels, rounded. An odd last row or column is dropped, because including it would stretch the
// other pixels. *half keeps its memory if its size is unchanged.
void HalveImage(const cv::Mat& image, cv::Mat* half);

// A FAST corner at integer pixel coordinates of one level.
struct Corner {
  std::int16_t x = 0, y = 0;
};

// Images held by an ImageStore.
class StoredImages {
 public:
  virtual ~StoredImages() = default;
  // See ImageFeatures::MarkInUse. Any thread.
  virtual void MarkInUse() const = 0;
};

// Everything that tracking and mapping use of one image. Level 0 is the full grey image (CV_8UC1), each
// further level half its size (2x2 mean). Corners are sorted by row, then column.
struct ImageFeatures {
  std::array<cv::Mat, kPyramidLevels> levels;
  std::array<std::vector<Corner>, kPyramidLevels> corners;
  // row_begin[l][y] is the index of the first corner of level l in row y or below; it has rows + 1 entries.
  std::array<std::vector<int>, kPyramidLevels> row_begin;
  std::array<int, kPyramidLevels> fast_threshold{};
  SmallBlurryImage small_blurry;
  std::shared_ptr<const StoredImages> stored;  // null if the levels are in ordinary memory

  // To be called before the levels are read, so that the image store can evict other images. Code that
  // iterates over keyframes calls it for each of them; the cost is negligible, and without the call the
  // pixels are the same.
  void MarkInUse() const {
    if (stored) stored->MarkInUse();
  }
};

}  // namespace docent::engine

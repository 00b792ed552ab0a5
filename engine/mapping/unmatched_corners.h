// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "engine/map/map.h"

// Corners of a keyframe that no point of the map explains yet: what new points are made of. For the mapper's
// thread.
namespace docent::engine {

// Which places of a pyramid level are taken: a coarse raster about the features that are.
class Occupancy {
 public:
  // cell: pixels of the level.
  Occupancy(const cv::Mat& image, float cell);
  void Take(const Eigen::Vector2f& pixel);
  bool Taken(const Eigen::Vector2f& pixel) const;

 private:
  std::size_t Index(const Eigen::Vector2f& pixel) const;

  float cell_;
  int columns_;
  std::vector<bool> taken_;
};

struct ScoredCorner {
  float score;  // Shi-Tomasi, grey values squared
  Corner corner;
};

// The corners of a level that score at least min_score, best first, where neither *occupancy nor an
// observation of the keyframe on this or a neighbouring level has taken the place; the observations are
// entered into *occupancy.
std::vector<ScoredCorner> UnmatchedCorners(const Map::KeyFrameRecord& keyframe, std::size_t level,
                                           float min_score, Occupancy* occupancy);

}  // namespace docent::engine

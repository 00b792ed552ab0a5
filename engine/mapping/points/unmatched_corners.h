// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "engine/map/map.h"

// Corners of a keyframe that are not observations of a map point yet, from which new points are created. For
// the mapper's thread.
namespace docent::engine {

// A coarse grid over a pyramid level that marks which cells already have a feature.
class Occupancy {
 public:
  // cell: width of a cell, in pixels of the level.
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

// The corners of a level with a score of at least min_score, best first, in cells that neither *occupancy nor
// an observation of the keyframe on this or a neighbouring level has taken. Marks the observations in
// *occupancy.
std::vector<ScoredCorner> UnmatchedCorners(const Map::KeyFrameRecord& keyframe, std::size_t level,
                                           float min_score, Occupancy* occupancy);

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/points/unmatched_corners.h"

#include <algorithm>
#include <cstdlib>

#include "engine/vision/patch.h"

namespace docent::engine {

Occupancy::Occupancy(const cv::Mat& image, float cell)
    : cell_(cell), columns_(static_cast<int>(static_cast<float>(image.cols) / cell) + 1) {
  taken_.resize(static_cast<std::size_t>(columns_) *
                (static_cast<std::size_t>(static_cast<float>(image.rows) / cell) + 1));
}

void Occupancy::Take(const Eigen::Vector2f& pixel) {
  const std::size_t at = Index(pixel);
  if (at < taken_.size()) taken_[at] = true;
}

bool Occupancy::Taken(const Eigen::Vector2f& pixel) const {
  const std::size_t at = Index(pixel);
  return at >= taken_.size() || taken_[at];
}

std::size_t Occupancy::Index(const Eigen::Vector2f& pixel) const {
  return static_cast<std::size_t>(static_cast<int>(pixel.y() / cell_) * columns_ +
                                  static_cast<int>(pixel.x() / cell_));
}

std::vector<ScoredCorner> UnmatchedCorners(const Map::KeyFrameRecord& keyframe, std::size_t level,
                                           float min_score, Occupancy* occupancy) {
  const ImageFeatures& features = *keyframe.keyframe.features;
  features.MarkInUse();
  const cv::Mat& image = features.levels[level];
  for (const Observation& observation : keyframe.observations) {
    // An observation on a neighbouring level belongs to the same structure.
    if (std::abs(static_cast<int>(observation.level) - static_cast<int>(level)) > 1) continue;
    occupancy->Take(
        LevelFromLevelZero(observation.pixel.cast<double>(), static_cast<int>(level)).cast<float>());
  }
  std::vector<ScoredCorner> corners;
  for (const Corner& corner : features.corners[level]) {
    if (!PatchFits(image, corner.x, corner.y, 2.0f) || occupancy->Taken({corner.x, corner.y})) continue;
    const float score = ShiTomasiScore(image, corner.x, corner.y);
    if (score >= min_score) corners.push_back({score, corner});
  }
  std::stable_sort(corners.begin(), corners.end(),
                   [](const ScoredCorner& a, const ScoredCorner& b) { return a.score > b.score; });
  return corners;
}

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#include "engine/dense/depth_views.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <span>

#include "engine/base/option_check.h"

namespace docent::engine {
namespace {

// The finite points that a localized keyframe observes, by ascending id.
struct ObservedPoints {
  const KeyFrame* keyframe = nullptr;
  Eigen::Vector3d center_in_map = Eigen::Vector3d::Zero();
  std::vector<const MapPoint*> points;
};

std::vector<ObservedPoints> PointsByKeyFrame(const MapSnapshot& map) {
  std::vector<ObservedPoints> observed;
  auto observation = map.observations.begin();
  for (const KeyFrame& keyframe : map.keyframes) {
    ObservedPoints entry{&keyframe, keyframe.camera_from_map.OriginInSource(), {}};
    while (observation != map.observations.end() && observation->keyframe < keyframe.id) ++observation;
    for (; observation != map.observations.end() && observation->keyframe == keyframe.id; ++observation) {
      const MapPoint* const point = map.FindPoint(observation->point);
      if (point != nullptr && !point->infinite()) entry.points.push_back(point);
    }
    if (keyframe.kind == KeyFrameKind::kSixDof) observed.push_back(std::move(entry));
  }
  return observed;
}

// Pairs below this mean score of their points have too little parallax: about a degree with the default
// options.
constexpr double kMinMeanScore = 0.15;

struct ScoredNeighbour {
  const ObservedPoints* view;
  double score;
};

// The sum over the shared points of how good their parallax is; 0 if too few are shared or
// their parallax is too small.
double PairScore(const ObservedPoints& a, const ObservedPoints& b, const DepthViewOptions& options) {
  constexpr double kDegree = std::numbers::pi / 180;
  double score = 0;
  int shared = 0;
  auto other = b.points.begin();
  for (const MapPoint* const point : a.points) {
    while (other != b.points.end() && (*other)->id < point->id) ++other;
    if (other == b.points.end()) break;
    if (*other != point) continue;
    ++shared;
    const Eigen::Vector3d to_a = a.center_in_map - point->position(),
                          to_b = b.center_in_map - point->position();
    const double parallax_deg = std::atan2(to_a.cross(to_b).norm(), to_a.dot(to_b)) / kDegree;
    const double difference_deg = parallax_deg - options.best_parallax_deg;
    const double sigma_deg = difference_deg < 0 ? options.less_parallax_deg : options.more_parallax_deg;
    score += std::exp(-0.5 * difference_deg * difference_deg / (sigma_deg * sigma_deg));
  }
  return shared >= options.min_shared_points && score >= kMinMeanScore * shared ? score : 0;
}

// Takes the best neighbour repeatedly. One in the same direction as an earlier one is worth less, because
// surfaces that are hidden from it are hidden from both.
std::vector<KeyFrameId> BestNeighbours(const ObservedPoints& view, std::vector<ScoredNeighbour> candidates,
                                       const DepthViewOptions& options) {
  constexpr double kMinScore = 1.0;  // As much as one shared point with the best parallax.
  std::vector<KeyFrameId> chosen;
  while (static_cast<int>(chosen.size()) < options.max_neighbours && !candidates.empty()) {
    const auto best = std::max_element(
        candidates.begin(), candidates.end(),
        [](const ScoredNeighbour& a, const ScoredNeighbour& b) { return a.score < b.score; });
    if (best->score < kMinScore) break;
    const ObservedPoints& taken = *best->view;
    chosen.push_back(taken.keyframe->id);
    candidates.erase(best);
    const Eigen::Vector3d direction = (taken.center_in_map - view.center_in_map).normalized();
    for (ScoredNeighbour& candidate : candidates) {
      const Eigen::Vector3d other = (candidate.view->center_in_map - view.center_in_map).normalized();
      candidate.score *= 1 - 0.5 * std::max(0.0, direction.dot(other));
    }
  }
  return chosen;
}

// False if too few points determine the range.
bool FindRange(const ObservedPoints& view, const DepthViewOptions& options, DepthViews* result) {
  std::vector<double> inverse;
  for (const MapPoint* const point : view.points) {
    const double distance = (point->position() - view.center_in_map).norm();
    if (distance > 0) inverse.push_back(1 / distance);
  }
  if (static_cast<int>(inverse.size()) < options.min_points) return false;
  std::sort(inverse.begin(), inverse.end());
  constexpr double kOutliers = 0.01;  // On each side.
  const auto quantile = static_cast<std::size_t>(kOutliers * static_cast<double>(inverse.size()));
  result->min_inverse_distance = inverse[quantile] / options.range_margin;
  result->max_inverse_distance = inverse[inverse.size() - 1 - quantile] * options.range_margin;
  return true;
}

}  // namespace

std::optional<std::string> DepthViewOptions::Validate() const {
  return OptionCheck()
      .Within(max_neighbours, 1, 16, "number of neighbours")
      .AtLeast(min_shared_points, 1, "number of shared points")
      .Positive(best_parallax_deg, "best parallax")
      .Positive(less_parallax_deg, "spread of smaller parallaxes")
      .Positive(more_parallax_deg, "spread of larger parallaxes")
      .AtLeast(min_points, 2, "number of points")
      .Within(range_margin, 1, 100, "margin of the range")
      .fault();
}

std::vector<DepthViews> ChooseDepthViews(const MapSnapshot& map, const DepthViewOptions& options) {
  Checked(options);
  const std::vector<ObservedPoints> observed = PointsByKeyFrame(map);
  std::vector<DepthViews> result;
  for (const ObservedPoints& view : observed) {
    DepthViews views;
    views.keyframe = view.keyframe->id;
    if (!FindRange(view, options, &views)) continue;
    std::vector<ScoredNeighbour> candidates;
    for (const ObservedPoints& other : observed) {
      if (&other == &view) continue;
      const double score = PairScore(view, other, options);
      if (score > 0) candidates.push_back({&other, score});
    }
    views.neighbours = BestNeighbours(view, std::move(candidates), options);
    if (!views.neighbours.empty()) result.push_back(std::move(views));
  }
  return result;
}

}  // namespace docent::engine

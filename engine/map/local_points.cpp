// SPDX-License-Identifier: Apache-2.0
#include "engine/map/local_points.h"

#include <algorithm>
#include <utility>

namespace docent::engine {

namespace {

constexpr std::size_t kMinPoints = 12;
constexpr double kOutlier = 2.5;  // times the median residual of the similarity
constexpr int kRounds = 5;        // each with the inliers of the previous one

}  // namespace

LocalPoints NearestPoints(const MapSnapshot& map, const Eigen::Vector3d& position, std::size_t count) {
  std::vector<std::pair<double, const MapPoint*>> nearest;
  nearest.reserve(map.points.size());
  for (const MapPoint& point : map.points) {
    if (!point.infinite()) nearest.emplace_back((point.position() - position).squaredNorm(), &point);
  }
  count = std::min(count, nearest.size());
  std::partial_sort(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(count), nearest.end(),
                    [](const auto& a, const auto& b) { return a.first < b.first; });
  nearest.resize(count);
  std::sort(nearest.begin(), nearest.end(),
            [](const auto& a, const auto& b) { return a.second->id < b.second->id; });
  LocalPoints local;
  for (const auto& [distance, point] : nearest) {
    local.ids.push_back(point->id);
    local.positions.push_back(point->position());
  }
  return local;
}

std::optional<Sim3> EstimateMotion(const LocalPoints& before, const MapSnapshot& now) {
  std::vector<Eigen::Vector3d> from, to;
  for (std::size_t i = 0; i < before.ids.size(); ++i) {
    const MapPoint* point = now.FindPoint(before.ids[i]);
    if (!point || point->infinite()) continue;
    from.push_back(before.positions[i]);
    to.push_back(point->position());
  }
  if (from.size() < kMinPoints) return std::nullopt;
  std::optional<Sim3> motion = AlignSim3(to, from);
  std::vector<double> residuals(from.size()), sorted;
  std::vector<Eigen::Vector3d> kept_from, kept_to;
  for (int round = 0; motion && round < kRounds; ++round) {
    for (std::size_t i = 0; i < from.size(); ++i) residuals[i] = (to[i] - *motion * from[i]).norm();
    sorted = residuals;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    kept_from.clear();
    kept_to.clear();
    for (std::size_t i = 0; i < from.size(); ++i) {
      if (residuals[i] > kOutlier * *middle) continue;
      kept_from.push_back(from[i]);
      kept_to.push_back(to[i]);
    }
    motion = AlignSim3(kept_to, kept_from);
  }
  return motion;
}

}  // namespace docent::engine

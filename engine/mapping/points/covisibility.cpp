// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/points/covisibility.h"

#include <algorithm>
#include <limits>

namespace docent::engine {

Covisibility::Covisibility(const Map& map) {
  for (const auto& [id, record] : map.keyframes()) {
    if (record.keyframe.kind == KeyFrameKind::kSixDof) keyframes_.push_back(id);
  }
  counts_.assign(keyframes_.size() * keyframes_.size(), 0);
  std::vector<std::size_t> indices;
  for (const Map::PointRecord& point : map.points()) {
    if (!point.alive || point.point.infinite()) continue;
    indices.clear();
    for (const KeyFrameId observer : point.observers) {
      if (const std::size_t index = IndexOf(observer); index < keyframes_.size()) indices.push_back(index);
    }
    for (const std::size_t a : indices) {
      for (const std::size_t b : indices) ++counts_[a * keyframes_.size() + b];
    }
  }
}

std::size_t Covisibility::IndexOf(KeyFrameId id) const {
  const auto found = std::lower_bound(keyframes_.begin(), keyframes_.end(), id);
  if (found == keyframes_.end() || *found != id) return keyframes_.size();
  return static_cast<std::size_t>(found - keyframes_.begin());
}

bool Covisibility::AreNeighbours(std::size_t a, std::size_t b) const {
  constexpr double kMinRatio = 0.2;
  constexpr int kMinShared = 15;
  const std::size_t count = keyframes_.size();
  const int observed = std::min(counts_[a * count + a], counts_[b * count + b]);
  return Shared(a, b) >= std::max(kMinShared, static_cast<int>(kMinRatio * observed));
}

double Covisibility::PathLengthBetween(KeyFrameId from, KeyFrameId to, const Map& map) const {
  constexpr double kUnreachable = std::numeric_limits<double>::infinity();
  const std::size_t count = keyframes_.size(), start = IndexOf(from), end = IndexOf(to);
  if (start == count || end == count) return kUnreachable;
  std::vector<Eigen::Vector3d> centers;
  for (const KeyFrameId id : keyframes_)
    centers.push_back(map.keyframes().at(id).keyframe.camera_from_map.OriginInSource());
  std::vector<double> length(count, kUnreachable);
  std::vector<bool> visited(count, false);
  length[start] = 0;
  for (;;) {  // Dijkstra on a dense graph
    std::size_t nearest = count;
    for (std::size_t i = 0; i < count; ++i) {
      if (!visited[i] && length[i] < kUnreachable && (nearest == count || length[i] < length[nearest]))
        nearest = i;
    }
    if (nearest == count || nearest == end) return length[end];
    visited[nearest] = true;
    for (std::size_t i = 0; i < count; ++i) {
      if (!AreNeighbours(nearest, i)) continue;
      length[i] = std::min(length[i], length[nearest] + (centers[i] - centers[nearest]).norm());
    }
  }
}

}  // namespace docent::engine

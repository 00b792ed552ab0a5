// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/policy.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace docent::maps {

namespace {

constexpr std::array<std::pair<Policy, const char*>, 4> kNames = {{{Policy::kOpen, "open"},
                                                                   {Policy::kBounded, "bounded"},
                                                                   {Policy::kAugmentOnly, "augment-only"},
                                                                   {Policy::kReadOnly, "read-only"}}};
constexpr double kIgnoredRatio = 0.01;  // Ratio of the points ignored at either end of each axis.

// The quantiles kIgnoredRatio and 1 - kIgnoredRatio of the values.
std::pair<double, double> MiddleRange(std::vector<double>& values) {
  const auto skipped = static_cast<std::ptrdiff_t>(kIgnoredRatio * static_cast<double>(values.size()));
  const auto low = values.begin() + skipped;
  std::nth_element(values.begin(), low, values.end());
  const double low_value = *low;
  const auto high = values.end() - 1 - skipped;
  std::nth_element(values.begin(), high, values.end());
  return {low_value, *high};
}

}  // namespace

const char* ToString(Policy policy) {
  return kNames[static_cast<std::size_t>(policy)].second;
}

std::optional<Policy> ParsePolicy(std::string_view text) {
  for (const auto& [policy, name] : kNames) {
    if (text == name) return policy;
  }
  return std::nullopt;
}

bool MayChangeStructure(Policy policy) {
  return policy == Policy::kOpen || policy == Policy::kBounded;
}
bool MayChangeContent(Policy policy) {
  return policy != Policy::kReadOnly;
}
bool MayRemove(Policy policy) {
  return MayChangeStructure(policy);
}

Policy Stricter(Policy a, Policy b) {
  return std::max(a, b);  // The enumerators are ordered by strictness.
}

std::optional<Bounds> ComputeBounds(const engine::MapSnapshot& map) {
  if (map.keyframes.empty()) return std::nullopt;
  Bounds bounds;
  bounds.min = bounds.max = map.keyframes.front().camera_from_map.OriginInSource();
  for (const engine::KeyFrame& keyframe : map.keyframes) {
    const Eigen::Vector3d center = keyframe.camera_from_map.OriginInSource();
    bounds.min = bounds.min.cwiseMin(center);
    bounds.max = bounds.max.cwiseMax(center);
  }
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const engine::MapPoint& point : map.points) {
      if (!point.infinite()) values.push_back(point.point_in_map[axis]);
    }
    if (values.empty()) break;
    const auto [low, high] = MiddleRange(values);
    bounds.min[axis] = std::min(bounds.min[axis], low);
    bounds.max[axis] = std::max(bounds.max[axis], high);
  }
  return bounds;
}

Bounds Expanded(const Bounds& bounds, double fraction) {
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(fraction * (bounds.max - bounds.min).norm());
  return {bounds.min - margin, bounds.max + margin};
}

bool KeyFrameAllowed(Policy policy, const std::optional<Bounds>& bounds, const Eigen::Vector3d& position) {
  if (policy == Policy::kOpen) return true;
  if (policy != Policy::kBounded || !bounds) return false;
  return (position.array() >= bounds->min.array()).all() && (position.array() <= bounds->max.array()).all();
}

}  // namespace docent::maps

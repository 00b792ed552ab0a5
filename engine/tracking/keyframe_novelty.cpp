// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/keyframe_novelty.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "engine/base/option_check.h"

namespace docent::engine {

namespace {

// Number of observations of a keyframe; of finite points only unless with_infinite.
std::ptrdiff_t CountObservations(const MapSnapshot& map, KeyFrameId id, bool with_infinite) {
  const auto before = [](const Observation& observation, KeyFrameId wanted) {
    return observation.keyframe < wanted;
  };
  const auto first = std::lower_bound(map.observations.begin(), map.observations.end(), id, before);
  const auto last = std::lower_bound(first, map.observations.end(), id + 1, before);
  if (!with_infinite) return last - first;
  return std::count_if(first, last, [&](const Observation& observation) {
    const MapPoint* point = map.FindPoint(observation.point);
    return point && !point->infinite();
  });
}

}  // namespace

std::optional<std::string> KeyFrameNoveltyOptions::Validate() const {
  return OptionCheck()
      .Positive(min_distance, "distance between keyframes")
      .Positive(min_rotation_deg, "rotation between keyframes")
      .Ratio(min_found_ratio, "ratio of points found")
      .AtLeast(max_expected_points, 0, "number of expected points")
      .AtLeast(min_distance_when_few, 0, "distance between keyframes when few points are found")
      .AtLeast(min_rotation_when_few_deg, 0, "rotation between keyframes when few points are found")
      .fault();
}

bool NeedsKeyFrame(const KeyFrameNoveltyOptions& options, const MapSnapshot& map,
                   const Rigid3& camera_from_map, const MapTrackResult& tracked) {
  const Eigen::Vector3d center = camera_from_map.OriginInSource();
  const double depth = tracked.median_depth > 0 ? tracked.median_depth : 1.0;
  double nearest = std::numeric_limits<double>::max();
  double nearest_distance = 0, nearest_rotation_deg = 0;
  const KeyFrame* nearest_keyframe = nullptr;
  for (const KeyFrame& keyframe : map.keyframes) {
    if (keyframe.kind == KeyFrameKind::kPanorama) continue;  // its position is unknown
    const double distance = (keyframe.camera_from_map.OriginInSource() - center).norm() / depth;
    const double rotation_deg =
        (camera_from_map.rotation * keyframe.camera_from_map.rotation.inverse()).Angle() * 180 /
        std::numbers::pi;
    const double novelty =
        std::hypot(distance / options.min_distance, rotation_deg / options.min_rotation_deg);
    if (novelty < nearest) {
      nearest = novelty;
      nearest_distance = distance;
      nearest_rotation_deg = rotation_deg;
      nearest_keyframe = &keyframe;
    }
  }
  if (nearest > 1.0) return true;
  const bool moved = nearest_distance > options.min_distance_when_few ||
                     nearest_rotation_deg > options.min_rotation_when_few_deg;
  if (!moved || !nearest_keyframe) return false;
  const auto observed =
      static_cast<double>(CountObservations(map, nearest_keyframe->id, nearest_keyframe->panorama != kNoId));
  return tracked.finite_inliers < options.min_found_ratio * std::min(observed, options.max_expected_points);
}

}  // namespace docent::engine

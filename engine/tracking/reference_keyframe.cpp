// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/reference_keyframe.h"

#include <algorithm>
#include <map>
#include <utility>

#include "engine/tracking/tracker.h"

namespace docent::engine {

KeyFrameId FindReferenceKeyFrame(const MapSnapshot& map, std::span<const PointMatch> matches) {
  if (map.keyframes.empty()) return kNoId;
  std::map<KeyFrameId, int> votes;
  for (const PointMatch& match : matches) {
    const MapPoint* point = match.inlier ? map.FindPoint(match.point) : nullptr;
    if (point) ++votes[point->source_keyframe];
  }
  if (votes.empty()) return map.keyframes.back().id;
  // With equal counts the newest.
  return std::max_element(votes.begin(), votes.end(),
                          [](const auto& a, const auto& b) {
                            return std::pair(a.second, a.first) < std::pair(b.second, b.first);
                          })
      ->first;
}

void Tracker::ApplyCorrections(const MapSnapshot& newer) {
  if (newer.corrections.empty() || newer.corrections.back()->revision <= map_->revision) return;
  const KeyFrameId reference_keyframe = FindReferenceKeyFrame(
      *map_, tracking_ ? std::span(map_tracker_.matches()) : std::span<const PointMatch>());
  for (const auto& correction : newer.corrections) {
    if (correction->revision <= map_->revision || correction->revision > newer.revision) continue;
    const auto moved = correction->after_from_before.find(reference_keyframe);
    if (moved == correction->after_from_before.end()) continue;
    motion_.ApplyCorrection(moved->second);
    rotation_reference_pose_ = CorrectedPose(rotation_reference_pose_, moved->second);
    median_depth_ *= moved->second.scale;
    pivot_estimate_.pivot *= moved->second.scale;
    rotation_center_.Reset();
  }
}

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/reference_keyframe.h"

#include <algorithm>
#include <map>
#include <utility>

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

}  // namespace docent::engine

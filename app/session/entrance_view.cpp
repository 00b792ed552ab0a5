// SPDX-License-Identifier: Apache-2.0
#include "app/session/entrance_view.h"

#include <algorithm>

namespace docent::app {

std::optional<engine::KeyFrameId> MostSimilarKeyFrame(const engine::MapSnapshot& map,
                                                      const engine::Rigid3& camera_from_map) {
  // A shift by a fraction of the depth changes an image about as much as a rotation by this angle in radians.
  const auto difference = [&](const engine::KeyFrame& keyframe) {
    const engine::Rigid3 motion = camera_from_map * keyframe.camera_from_map.inverse();
    return motion.translation.norm() / keyframe.mean_depth + motion.rotation.Angle();
  };
  const auto nearest =
      std::min_element(map.keyframes.begin(), map.keyframes.end(),
                       [&](const auto& a, const auto& b) { return difference(a) < difference(b); });
  return nearest == map.keyframes.end() ? std::nullopt : std::optional(nearest->id);
}

const engine::KeyFrame* EntranceOf(const engine::MapSnapshot& map, const content::MapSettings& settings) {
  const engine::KeyFrame* chosen = settings.entrance ? map.FindKeyFrame(*settings.entrance) : nullptr;
  if (chosen != nullptr) return chosen;
  return map.keyframes.empty() ? nullptr : &map.keyframes.front();
}

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "content/map_settings.h"
#include "engine/map/map_snapshot.h"

// The view of a map that is shown to visitors who look for it. Pure functions; any thread.
namespace docent::app {

// The keyframe whose view is most like that of a camera with this pose; empty for a map without keyframes.
std::optional<engine::KeyFrameId> MostSimilarKeyFrame(const engine::MapSnapshot& map,
                                                      const engine::Rigid3& camera_from_map);
// The keyframe that the author chose, or the first one if none was chosen or it is not in the map any more;
// null for a map without keyframes.
const engine::KeyFrame* EntranceOf(const engine::MapSnapshot& map, const content::MapSettings& settings);

}  // namespace docent::app

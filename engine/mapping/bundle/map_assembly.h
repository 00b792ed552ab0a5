// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <vector>

#include "engine/map/map.h"
#include "engine/mapping/bundle/bundle_adjustment.h"

namespace docent::engine {

// Keyframes and finite points of a map as a bundle problem, with the map's ids of its cameras and points.
struct MapAssembly {
  BundleProblem problem;
  std::vector<KeyFrameId> cameras;
  std::vector<MapPointId> points;
};

// `keyframe` and the `window` keyframes that share most points with it.
std::set<KeyFrameId> KeyFramesAround(int window, KeyFrameId keyframe, Map* map);
// `keyframe`, the `window` keyframes that share most points with it, and all their points; the other
// observers of these points, at most `max_fixed`, are fixed (ptamm §2.3). The keyframe must exist.
MapAssembly AssembleAround(int window, int max_fixed, KeyFrameId keyframe, Map* map);
// All keyframes with a position and all their points. The keyframes marked `fixed` are fixed.
MapAssembly AssembleAll(Map* map);

}  // namespace docent::engine

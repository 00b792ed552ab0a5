// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>

#include "engine/geometry/rigid3.h"
#include "engine/geometry/sim3.h"

namespace docent::engine {

// The motion of a map's parts when a loop was closed: poses and positions in the former coordinates must be
// transformed by it. A part is a keyframe with the points that it is the source of. Created by the mapper;
// immutable in snapshots.
struct MapCorrection {
  std::uint64_t revision = 0;                            // of the first corrected snapshot
  std::map<std::uint32_t, Sim3> after_from_before = {};  // by keyframe, for all that existed then
};

// The pose of a camera that moves with a part of the map, so that its view of the part stays the same.
// Lengths in the camera frame are scaled by `after_from_before.scale`.
Rigid3 CorrectedPose(const Rigid3& camera_from_map, const Sim3& after_from_before);

}  // namespace docent::engine

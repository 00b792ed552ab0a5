// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>

#include "engine/geometry/rigid3.h"
#include "engine/geometry/sim3.h"

namespace docent::engine {

// How a map was moved as a whole, part by part, when a loop was closed: by so much that whoever holds a pose
// or a place in the coordinates before must carry it along. The parts are the reference_keyframe of
// keyframes. Made by the mapper; immutable in snapshots.
struct MapCorrection {
  std::uint64_t revision = 0;                            // of the first snapshot that is corrected
  std::map<std::uint32_t, Sim3> after_from_before = {};  // by keyframe, of all there were
};

// The pose of a camera that goes along with a part of the map: it sees of it what it saw before. Lengths in
// the camera's frame are `after_from_before.scale` times what they were.
Rigid3 CarriedAlong(const Rigid3& camera_from_map, const Sim3& after_from_before);

}  // namespace docent::engine

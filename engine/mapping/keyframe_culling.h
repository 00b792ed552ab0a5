// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "engine/map/map.h"

namespace docent::engine {

struct KeyFrameCullingOptions {
  double min_known = 0.95;  // share of a keyframe's points ...
  int min_observers = 4;    // ... that so many others see as well or from nearer
  int min_keyframes = 8;    // of a map of which none is missed
  // Another keyframe must stand as near and look the same way: places are recognised by keyframes too.
  double max_distance = 0.15;  // of the depth
  double max_turn_deg = 15;
};

// A localized keyframe that adds nothing to what others know; kNoId for none. Never a fixed one, a reference
// of a panorama map, or one from `newest` on, round which the map still grows.
KeyFrameId FindRedundantKeyFrame(const KeyFrameCullingOptions& options, KeyFrameId newest, Map* map);

// Removes a localized keyframe without its points: those that it is the source of take another observer for
// their source, the one that sees them on the finest level. So the cost of a map follows the space it shows
// and not the time spent in it.
void CullKeyFrame(KeyFrameId keyframe, Map* map);

}  // namespace docent::engine

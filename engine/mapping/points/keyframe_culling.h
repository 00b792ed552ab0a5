// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "engine/map/map.h"

namespace docent::engine {

struct KeyFrameCullingOptions {
  double min_redundant_ratio = 0.95;  // A keyframe is redundant if this ratio of its points ...
  int min_observers = 4;  // ... is seen by at least this many others on the same or a finer level.
  int min_keyframes = 8;  // Maps with no more keyframes than this are not culled.
  // Another keyframe must also be this close in position and orientation, because keyframes serve place
  // recognition too.
  double max_distance = 0.15;  // ratio of the keyframe's median depth
  double max_rotation_deg = 15;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Finds a localized keyframe whose points other keyframes see well enough; kNoId if there is none. Never
// returns a fixed keyframe, a reference of a panorama map, or one with an id from `newest` on, where the map
// is still being extended.
KeyFrameId FindRedundantKeyFrame(const KeyFrameCullingOptions& options, KeyFrameId newest, Map* map);

// Finds the keyframe with the lowest id that may be removed; kNoId if there is none. Never returns a fixed
// keyframe, the `newest`, which the camera sees now, or a reference on which keyframes of a panorama map
// depend.
KeyFrameId FindOldestKeyFrame(KeyFrameId newest, const Map& map);

// Removes a keyframe but keeps its points: a point whose source it is gets the observer on the finest level
// as its new source. Culling keeps the cost of a map proportional to the space that it covers and not to the
// time spent there.
void CullKeyFrame(KeyFrameId keyframe, Map* map);

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "engine/map/map_snapshot.h"
#include "engine/tracking/map_tracker.h"

namespace docent::engine {

struct KeyFrameNoveltyOptions {
  double min_distance = 0.10;  // of the mean depth, to every keyframe that looks the same way (ptamm §2.2)
  double min_turn_deg = 14.0;  // turning that counts as much as min_distance
  double min_found_ratio = 0.60;  // fewer points than this share of the nearest keyframe's: the map runs out
  double max_known = 600;         // a keyframe that knows more has plenty: no frame looks for more than that
  double min_distance_when_few = 0.04;  // but never without parallax, of the mean depth
  double min_turn_when_few_deg = 5.0;
};

// Whether this frame should become a keyframe: new enough a view, or a map about to run out (ptamm §2.2).
// The tracking quality is the caller's to check.
bool WantsKeyFrame(const KeyFrameNoveltyOptions& options, const MapSnapshot& map,
                   const Rigid3& camera_from_map, const MapTrackResult& tracked);

}  // namespace docent::engine

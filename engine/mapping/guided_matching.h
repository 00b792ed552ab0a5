// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "engine/map/map.h"
#include "engine/tracking/point_search.h"

namespace docent::engine {

struct GuidedMatchingOptions {
  float radius_px = 6;            // about where the point projects, level 0
  double max_error_sigmas = 3.0;  // of what was found, in pixels of its level: further off is another thing
};

// Appearance in a localized keyframe for the finite points that it does not see yet although it should, and
// adds what it finds as observations: points that were made after the keyframe, and points that an earlier
// search missed (ptamm §2.3, data association refinement). The images' features are those of MakeFeatures.
// Returns how many were found. among: of these points alone (may be null). The caller adjusts the map
// afterwards; the searcher holds patches of this map alone.
int MatchMapPoints(const GuidedMatchingOptions& options, KeyFrameId keyframe, PointSearcher* searcher,
                   Map* map, const std::vector<MapPointId>* among = nullptr);

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/map/map.h"
#include "engine/matching/point_search.h"

namespace docent::engine {

struct GuidedMatchingOptions {
  float radius_px = 6;  // search radius about the projection of a point, level 0
  // Pixels of the match's level; a match further off is taken to be another feature.
  double max_error_sigmas = 3.0;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Searches a localized keyframe for finite points that it should see but does not observe yet, and adds the
// matches as observations (ptamm §2.3, data association refinement). These are points that were created after
// the keyframe, and points that an earlier search missed. The features of the images must come from
// MakeFeatures. among: restricts the search to these points (may be null). Returns the number of matches. The
// caller adjusts the map afterwards; `searcher` must hold patches of this map only.
int MatchMapPoints(const GuidedMatchingOptions& options, KeyFrameId keyframe, PointSearcher* searcher,
                   Map* map, const std::vector<MapPointId>* among = nullptr);

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "engine/map/map.h"
#include "engine/matching/point_search.h"

namespace docent::engine {

struct PointCreationOptions {
  std::array<int, kPyramidLevels> max_points = {180, 120, 80, 50};  // per keyframe pair, by level
  float min_corner_score = 40.0f;  // Shi-Tomasi, grey values squared: "particularly salient" (ptamm §2.3)
  // Weaker corners are accepted where the image has no better ones, since a few points are better than none.
  float min_faint_corner_score = 15.0f;
  int few_points = 3;  // cells of an 8x6 grid over the image with fewer points accept weaker corners
  float min_distance_px = 7.0f;  // to any matched feature of that level, pixels of the level (ptamm §2.3)
  float epipolar_tolerance_px = 2.0f;   // pixels of the level
  float min_correlation = 0.80f;        // of the best corner along the epipolar line
  float ambiguity_ratio = 0.75f;        // (1 - best) / (1 - second best); above it the match is ambiguous
  double min_parallax_deg = 0.6;        // below it the depth is too uncertain
  double max_reprojection_sigma = 2.0;  // in both views, in sigmas of the level

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Creates map points from unmatched corners of `target` by epipolar search in `partner` (ptamm §2.3):
// sub-pixel matches that are unique along the line and have enough parallax. Returns their ids.
std::vector<MapPointId> CreatePoints(const PointCreationOptions& options, KeyFrameId target,
                                     KeyFrameId partner, Map* map, PointSearcher* searcher);

struct InfiniteConversion {
  std::vector<MapPointId> converted;  // infinite before, finite now
  int merged = 0;                     // infinite points that were fused with finite points of the map
};

// Triangulates the infinite points whose source is `reference`, a localized keyframe, by epipolar search in
// `partner`, another localized keyframe, with the checks of CreatePoints (hybrid-slam §5.2). An infinite
// point that coincides with a finite point in both views becomes an observation of that point.
InfiniteConversion ConvertInfinitePoints(const PointCreationOptions& options, KeyFrameId reference,
                                         KeyFrameId partner, Map* map, PointSearcher* searcher);

}  // namespace docent::engine

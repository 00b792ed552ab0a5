// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "engine/map/map.h"
#include "engine/tracking/point_search.h"

namespace docent::engine {

struct PointCreationOptions {
  std::array<int, kPyramidLevels> max_points = {180, 120, 80, 50};  // a keyframe pair, by level
  float min_corner_score = 40.0f;  // Shi-Tomasi, grey values squared: "particularly salient" (ptamm §2.3)
  // Where the image has nothing better, faint corners must do: better a few than none.
  float min_faint_corner_score = 15.0f;
  int few_points = 3;            // in a cell of an 8x6 grid over the image: there faint corners count
  float min_distance_px = 7.0f;  // to any matched feature of that level, pixels of the level (ptamm §2.3)
  float epipolar_tolerance_px = 2.0f;   // of the level
  float min_correlation = 0.80f;        // of the best corner along the epipolar line
  float ambiguity_ratio = 0.75f;        // (1 - best) / (1 - second best); above it the match is not unique
  double min_parallax_deg = 0.6;        // below it the depth would be a guess
  double max_reprojection_sigma = 2.0;  // in both views, in sigmas of the level
};

// New map points from corners of `target` that no point explains yet, by epipolar search in `partner`
// (ptamm §2.3): sub-pixel matches, unique along the line, with enough parallax. Returns their ids.
std::vector<MapPointId> CreatePoints(const PointCreationOptions& options, KeyFrameId target,
                                     KeyFrameId partner, Map* map, PointSearcher* searcher);

struct InfiniteConversion {
  std::vector<MapPointId> converted;  // infinite before, finite now
  int merged = 0;                     // turned out to be finite points that the map had
};

// Triangulates infinite points that `reference`, a localized keyframe, is the source of, by epipolar search
// in `partner`, a localized keyframe elsewhere, with the checks of CreatePoints (hybrid-slam §5.2). One that
// meets a finite point of the map in both views becomes an observation of it.
InfiniteConversion ConvertInfinitePoints(const PointCreationOptions& options, KeyFrameId reference,
                                         KeyFrameId partner, Map* map, PointSearcher* searcher);

}  // namespace docent::engine

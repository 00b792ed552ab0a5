// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/geometry/sim3.h"
#include "engine/map/map.h"
#include "engine/tracking/point_search.h"

// Whether a keyframe shows a place that the map knows from before although nothing of it was found again: the
// geometric proof, by the points of that place. For the mapper's thread.
namespace docent::engine {

struct LoopVerificationOptions {
  // Points of the place are looked for in the keyframe, about a first pose and about a better one.
  float first_radius_px = 24, radius_px = 8;  // level 0
  std::size_t first_points = 300, min_first_found = 20;
  std::size_t max_points = 1000;
  int min_inliers = 50;
  double min_inlier_ratio = 0.15;    // of the points that should be in the image; many are hidden
  int min_cells = 7;                 // of a 4x4 grid over the image
  double max_sigma = 2.0;            // robust, of the normalised residuals
  double max_position_sigma = 0.02;  // of the depth
  // A point of the place and a recent one that are seen within this are taken to be one ("duplicates").
  double twin_px = 2.0;  // of the coarser of their levels
  int min_twins = 25;
  double max_scale_spread = 0.1;  // robust, of their depths' ratios: they are the same surfaces
  // And the other way about: the recent points are looked for in the place's keyframe.
  int min_back_inliers = 30;
  double min_back_ratio = 0.15;
};

// One physical point that the map has twice.
struct DuplicatePoints {
  MapPointId known = kNoId, recent = kNoId;
};

// A keyframe that shows a known place.
struct LoopCandidate {
  KeyFrameId keyframe = kNoId, place = kNoId;
  // Camera frames, of which each has the unit of length that the map has about it: the scale says how far
  // these have drifted apart.
  Sim3 keyframe_from_place;
  std::vector<Observation> seen;  // points of the place, found in the keyframe
  std::vector<DuplicatePoints> duplicates;
  int expected = 0, back_inliers = 0;
  std::string Brief() const;
};

// place: the keyframes that know it, the one most like `keyframe` first; none shares its points.
// camera_from_map: where the keyframe stands if it shows the place, in the coordinates of the place. Empty
// where the proof fails; changes nothing.
std::optional<LoopCandidate> VerifyLoopCandidate(const LoopVerificationOptions& options, KeyFrameId keyframe,
                                                 std::span<const KeyFrameId> place,
                                                 const Rigid3& camera_from_map, Map* map,
                                                 PointSearcher* searcher);

}  // namespace docent::engine

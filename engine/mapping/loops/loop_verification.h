// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/geometry/sim3.h"
#include "engine/map/map.h"
#include "engine/matching/point_search.h"

// Verifies by geometry that a keyframe shows a known place although it observes none of its points: the
// points of that place are searched in the keyframe, and the other way round. For the mapper's thread.
namespace docent::engine {

struct LoopVerificationOptions {
  // The points of the place are searched in the keyframe twice: some of them about the initial pose, then all
  // about the refined one.
  float first_radius_px = 24, radius_px = 8;  // pixels of level 0
  std::size_t first_points = 300, min_first_matches = 20;
  std::size_t max_points = 1000;
  int min_inliers = 50;
  double min_inlier_ratio = 0.15;    // of the points that project into the image; many are occluded
  int min_cells = 7;                 // occupied cells of a 4x4 grid over the image
  double max_sigma = 2.0;            // robust standard deviation of the normalized residuals
  double max_position_sigma = 0.02;  // ratio of the mean depth of the inliers
  // A point of the place and a recent point that are observed within this distance count as duplicates.
  double max_duplicate_px = 2.0;  // of the coarser of their levels
  int min_duplicates = 25;
  double max_scale_spread = 0.1;  // robust standard deviation of the logarithm of their depth ratios, which
                                  // is small on common surfaces
  // The reverse check: the keyframe's own points are searched in the keyframe of the place.
  int min_reverse_inliers = 30;
  double min_reverse_ratio = 0.15;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Two map points for one physical point.
struct DuplicatePoints {
  MapPointId known = kNoId, recent = kNoId;
};

// A keyframe for which geometry has verified that it shows a known place.
struct LoopCandidate {
  KeyFrameId keyframe = kNoId, place = kNoId;
  // Relative pose of the camera frames. Each frame has the scale of the map around it, so the scale of the
  // similarity is the scale drift between them.
  Sim3 keyframe_from_place;
  std::vector<Observation> seen;  // points of the place that were found in the keyframe
  std::vector<DuplicatePoints> duplicates;
  int expected = 0, reverse_inliers = 0;  // points searched, and inliers of the reverse check
};

// place: keyframes that show the place, the one most similar to `keyframe` first; none shares points with it.
// camera_from_map: pose of the keyframe in the coordinates of the place, if it shows the place. Empty if the
// verification fails. Does not change the map.
std::optional<LoopCandidate> VerifyLoopCandidate(const LoopVerificationOptions& options, KeyFrameId keyframe,
                                                 std::span<const KeyFrameId> place,
                                                 const Rigid3& camera_from_map, Map* map,
                                                 PointSearcher* searcher);

}  // namespace docent::engine

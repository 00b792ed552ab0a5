// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/mapping/loops/loop_candidate_search.h"

// Decides whether two maps show one place, and estimates the similarity between them. Keyframes of one map
// are recognized in the other as for a loop (loop_candidate_search.h). Between two maps no limit on drift
// rules out a similar-looking but different place. A similarity is therefore also checked against everything
// that it brings into view: most of the keyframes that should see points of the other map must find many of
// them, the surfaces must agree, and no other similarity may do nearly as well. For one thread at a time;
// equal input gives an equal result.
namespace docent::engine {

struct MapOverlapOptions {
  LoopCandidateSearchOptions search = ThoroughSearch();
  // This many consecutive keyframes of one camera, each from another viewpoint than the one before, must be
  // recognized and agree, as for a loop.
  std::size_t min_consecutive = 3;
  // Ratio of the median depth, radians, logarithm of the scale: as for a loop.
  double max_disagreement = 0.05;
  // Ratio of the median depth, or radians, between two consecutive keyframes.
  double min_viewpoint_step = 0.02;
  // Two similarities that place a keyframe further apart than this are different hypotheses.
  double min_hypothesis_difference = 0.2;  // ratio of the median depth, radians, logarithm of the scale
  std::size_t max_hypotheses = 3;          // that are examined, those with most keyframes first
  // A keyframe is compared with keyframes of the other map that have about the same view: from further away,
  // other objects occlude what it should see.
  double max_view_distance = 0.5;  // ratio of the median depth
  double max_view_angle = 0.5;     // radians, between the optical axes
  // A keyframe with fewer expected points, or with points in fewer cells of a 4x4 grid, is not counted.
  int min_expected = 150;
  int min_cells = 7;
  // Minimum ratio of the keyframes with a view of the other map that confirm the similarity, and of the
  // expected points that these find in the median. Measured: where two maps truly overlap, 0.23-1.00 of the
  // keyframes, the fewer the more the maps have drifted apart, and 0.29-0.75 of the points (desks and a
  // kitchen seen again on another path, a flying drone, an office); where bays of a museum share cabinets,
  // columns and plinths, 0.06-1.00 of the keyframes and 0.16-0.20 of the points. The ratio of keyframes
  // hence ensures that most of the overlap fits, and the points and surfaces that it is one.
  double min_confirmed_ratio = 0.6;
  double min_found_ratio = 0.25;
  // Two places may contain the same objects, so that the checks so far pass, and differ around them. A
  // keyframe is therefore divided into regions. A point counts in its region if it is found, or if the
  // keyframe's own map has a surface there at the same depth, so that nothing occludes it. A region with at
  // least min_region_points points contradicts if at most the ratio min_region_found_ratio of them is found.
  // Measured: 0.1-8.2 % of the regions contradict for true overlaps, 28-54 % for bays of a museum, and
  // 18-21 % where every desk holds the same objects and other images hang on the wall behind.
  int regions_across = 8;
  int min_region_points = 8;
  double min_region_found_ratio = 0.1;
  double max_error_px = 3;              // of the level, for a point to count as found
  double surface_px = 16;               // level 0: half a patch of a middle level
  double surface_depth = 0.05;          // largest relative difference of depth on one surface
  double max_contradicted_ratio = 0.1;  // ratio of the regions
  // Largest ratio of the best hypothesis's points that another hypothesis may explain: 0.16 in the museum.
  double max_second_ratio = 0.5;

  // Options by which every candidate is described and verified, since two maps are compared once and not with
  // every new keyframe.
  static LoopCandidateSearchOptions ThoroughSearch();

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// The result of a comparison, with its figures.
struct MapOverlap {
  enum class Outcome : std::uint8_t {
    kOverlap,
    kNothingToCompare,   // a map has too few localized keyframes or no finite points
    kNothingRecognized,  // no keyframe of B was recognized in A
    kTooFewConsecutive,
    kTooFewConfirmed,  // too few of the keyframes with a view of the other map find what they should see
    kTooFewPoints,     // those that do find too few of its points
    kSurfacesDiffer,   // in too many regions the other map shows something else
    kAmbiguous,        // another similarity explains nearly as many points
    kInterrupted,
  };
  Outcome outcome = Outcome::kNothingToCompare;
  Sim3 a_from_b;                          // similarity of the best hypothesis
  std::vector<LoopCandidate> candidates;  // candidates that confirm it, of keyframes of both maps
  std::size_t recognized = 0;   // keyframes of B that were recognized, whatever similarity they imply
  std::size_t consecutive = 0;  // consecutive keyframes that agree
  std::size_t with_view = 0, confirmed = 0;  // keyframes of both maps with a view of the other map, and those
                                             // of them that confirm the best hypothesis
  double found_ratio = 0;  // median over the keyframes that confirm it of the ratio of expected points found
  std::size_t regions = 0, contradicted = 0;  // of these keyframes
  // Points found in the keyframes that confirm it, and in those that confirm the second hypothesis instead.
  std::size_t points = 0, second_points = 0;
};

// map: both maps side by side, without shared points or keyframes; the keyframes of B have the ids from
// first_of_b on. Does not change the map. interrupt may be null.
MapOverlap FindOverlap(const MapOverlapOptions& options, KeyFrameId first_of_b,
                       const std::atomic<bool>* interrupt, Map* map);

}  // namespace docent::engine

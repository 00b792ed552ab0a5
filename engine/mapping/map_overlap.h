// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/mapping/loop_candidate_search.h"

// Whether two maps show one place, and how they lie to each other. Keyframes of one map are recognised in the
// other as for a loop (loop_candidate_search.h). Between two maps no drift bound tells a place from a
// look-alike, so a similarity must also explain whatever it puts into view: of the keyframes that look at
// points of the other map under it most must find most of these points again, and no other similarity may do
// nearly as well. For one thread at a time; the same input gives the same result.
namespace docent::engine {

struct MapOverlapOptions {
  LoopCandidateSearchOptions search = ThoroughSearch();
  // So many keyframes in a row (as they were made, each from elsewhere than the one before) must be
  // recognised and agree: as for a loop.
  std::size_t in_a_row = 3;
  double max_disagreement = 0.05;    // of the depth, radians, logarithm of the scale: as for a loop
  double min_viewpoint_step = 0.02;  // of the depth or radians, between two keyframes in a row
  // Similarities that put a keyframe further apart than this are two hypotheses.
  double distinct = 0.2;       // of the depth, radians, logarithm of the scale
  std::size_t hypotheses = 3;  // that are examined, those with most keyframes first
  // A keyframe is compared with keyframes of the other map that show the same from about the same place: from
  // further off other things hide what it should see.
  double max_view_distance = 0.5;  // of the depth
  double max_view_angle = 0.5;     // radians
  // With fewer expected points, or with points in fewer cells of a 4x4 grid, it says neither yes nor no.
  int min_expected = 150;
  int min_cells = 7;
  // Shares of the keyframes that look at the other map and are confirmed, and of the expected points that the
  // median of these keyframes finds. Measured: 1.00 of the keyframes, and 0.35-0.54 (desks seen again on
  // another way) or 0.75 (halves of one recording) of the points where two maps truly overlap; where bays of
  // a museum share cabinets, columns and plinths, 0.62-0.71 of the keyframes and 0.16-0.17 of the points.
  double min_confirmed = 0.8;
  double min_found = 0.25;
  // Two places may hold the same things, so that all that was asked so far is found, and differ in what is
  // about these. A keyframe is divided into regions; a point counts in its region when it is found, or when
  // the keyframe's own map has a surface there at its depth, so that nothing hides it. A region of so many
  // points contradicts when so few of them are found. Measured: 0.1-5.2 % of the regions of desks seen again,
  // 18-21 % where every desk holds the same things and other images hang on the wall behind.
  int regions_across = 8;
  int min_region_points = 8;
  double min_region_found = 0.1;
  double max_error_px = 3;      // of the level, for a point to count as found
  double surface_px = 16;       // level 0: half a patch of a middle level
  double surface_depth = 0.05;  // relative
  double max_contradicted = 0.1;
  // Of the points that confirm the best hypothesis, that another one may explain: 0.16 in the museum.
  double max_second = 0.5;

  // Every candidate is described and proved: two maps are compared once, not with every new keyframe.
  static LoopCandidateSearchOptions ThoroughSearch();
};

// What became of the comparison.
struct MapOverlap {
  enum class Verdict : std::uint8_t {
    kOverlap,
    kNothingToCompare,   // a map has too few localized keyframes or no finite points
    kNothingRecognised,  // no keyframe of B shows a place of A
    kTooFewInARow,
    kContradicted,  // what should be in view is not found
    kAmbiguous,     // another similarity explains nearly as much
    kInterrupted,
  };
  Verdict verdict = Verdict::kNothingToCompare;
  Sim3 a_from_b;                           // of the best hypothesis
  std::vector<LoopCandidate> sightings;    // that confirm it, of keyframes of both maps
  std::size_t recognised = 0;              // keyframes of B that were recognised, whatever they say
  std::size_t in_a_row = 0;                // that agree
  std::size_t looking = 0, confirmed = 0;  // keyframes of both maps, under the best hypothesis
  double found = 0;                        // median share of the expected points, over the looking keyframes
  std::size_t regions = 0, contradicted = 0;  // of these keyframes
  // Found in the keyframes that confirm it, and in those that confirm the second hypothesis instead.
  std::size_t points = 0, second_points = 0;
  // The figures in one line, for logs.
  std::string Brief() const;
};

// One sentence that says why two maps are not joined; empty for kOverlap.
std::string ReasonNotToJoin(const MapOverlap& overlap);

// map: both maps, which share nothing; the keyframes of B have the ids from first_of_b on. Changes nothing in
// it. interrupt may be null.
MapOverlap FindOverlap(const MapOverlapOptions& options, KeyFrameId first_of_b,
                       const std::atomic<bool>* interrupt, Map* map);

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "engine/mapping/loop_candidate_search.h"

// A camera that walks around something and comes back is, for its map, somewhere else by then: small errors
// have added up, and what was known is mapped a second time (ptamm §6.2, Fig. 15). Here the map finds out:
// keyframes that look like known ones they share nothing with, and proof by geometry that holds for several
// in a row. For the mapper's thread.
namespace docent::engine {

struct LoopDetectorOptions {
  LoopCandidateSearchOptions search;
  // An error of less than this (of the depth, radians, logarithm of the scale) active search deals with.
  double least_error = 0.02;
  // Of more than this the place is another one that looks alike: what gathers on a way is small against it.
  double max_shift = 0.1;  // of the way between the two
  double max_turn = 0.35;  // radians
  double max_scale = 0.4;  // logarithm
  // So many keyframes in a row must say the same.
  std::size_t agreeing = 3;
  double max_disagreement = 0.05;  // of the depth, radians, logarithm of the scale
};

// Watches keyframes as they come. Everything it keeps are looks, ids and similarities between keyframes,
// which hold while the map is adjusted.
class LoopDetector {
 public:
  explicit LoopDetector(const LoopDetectorOptions& options) : options_(options), search_(options.search) {}

  void Clear();
  // Appearance at a localized keyframe. When it is the last of enough that agree: all of them, and the finder
  // begins anew. Else empty.
  std::vector<LoopCandidate> Look(KeyFrameId keyframe, Map* map, PointSearcher* searcher);

 private:
  std::optional<LoopCandidate> Sight(KeyFrameId keyframe, Map* map, PointSearcher* searcher);
  // Whether it tells of an error, and of one that may have come about.
  bool IsPlausible(const LoopCandidate& sighting, Map* map) const;
  bool Agree(const LoopCandidate& a, const LoopCandidate& b, Map* map) const;

  const LoopDetectorOptions options_;
  LoopCandidateSearch search_;
  std::vector<LoopCandidate> sightings_;  // of keyframes in a row
};

}  // namespace docent::engine

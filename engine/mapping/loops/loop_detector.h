// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/base/option_check.h"
#include "engine/mapping/loops/loop_candidate_search.h"

// Detects loops. When a camera moves around an object and returns, accumulated drift places it elsewhere in
// the map, and known surfaces are mapped a second time (ptamm §6.2, Fig. 15). A loop is detected when several
// keyframes in a row resemble known keyframes that share no points with them, and geometry verifies it each
// time. For the mapper's thread.
namespace docent::engine {

struct LoopDetectorOptions {
  LoopCandidateSearchOptions search;
  // Guided search copes with errors below this (ratio of the median depth, radians, logarithm of the scale),
  // so they need no loop closing.
  double min_error = 0.02;
  // Drift is small relative to the path that the camera took. A candidate that implies a larger error is
  // taken for a similar-looking but different place.
  double max_translation = 0.1;  // ratio of the path length between the two keyframes
  double max_rotation = 0.35;    // radians
  double max_log_scale = 0.4;    // logarithm of the scale
  // This many keyframes in a row must agree.
  std::size_t min_consecutive = 3;
  double max_disagreement = 0.05;  // ratio of the median depth, radians, logarithm of the scale

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Examines keyframes in the order in which they are added. It stores descriptors, ids and relative poses
// between keyframes only, which stay valid while the map is adjusted.
class LoopDetector {
 public:
  explicit LoopDetector(const LoopDetectorOptions& options)
      : options_(Checked(options)), search_(options.search) {}

  void Clear();
  // Searches a known place for a localized keyframe. When this completes a series of keyframes that agree,
  // returns the candidates of the whole series and starts anew; empty otherwise.
  std::vector<LoopCandidate> Detect(KeyFrameId keyframe, Map* map, PointSearcher* searcher);

 private:
  std::optional<LoopCandidate> FindCandidate(KeyFrameId keyframe, Map* map, PointSearcher* searcher);
  // True if the implied error is large enough to matter and small enough to be drift.
  bool IsPlausible(const LoopCandidate& candidate, Map* map) const;
  bool Agree(const LoopCandidate& a, const LoopCandidate& b, Map* map) const;

  const LoopDetectorOptions options_;
  LoopCandidateSearch search_;
  // Of keyframes in a row, apart from those of another camera that show nothing known; each agrees with the
  // one before it, and the first one with the last.
  std::vector<LoopCandidate> candidates_;
};

}  // namespace docent::engine

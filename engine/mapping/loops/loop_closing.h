// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/option_check.h"
#include "engine/mapping/loops/loop_correction.h"

namespace docent::engine {

struct LoopOptions {
  bool enabled = true;
  LoopDetectorOptions detector;
  LoopCorrectionOptions correction;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// A loop that was closed, with its figures.
struct ClosedLoop {
  KeyFrameId keyframe = kNoId, place = kNoId;  // of the last candidate
  // The error that the loop had accumulated, as the last candidate implies it.
  double drift = 0;            // ratio of the path length between the two keyframes
  double rotation = 0;         // radians
  double scale = 1;            // ratio
  std::size_t found = 0;       // points of the place that were found in the keyframe
  int expected = 0;            // points of the place that were searched
  std::size_t duplicates = 0;  // pairs of duplicate points in these two keyframes
  int reverse_inliers = 0;     // points of the keyframe that were found in that of the place
  int fused = 0;               // pairs of duplicate points of all candidates that were fused
};

// Closes the loops of one map (ptamm §6.2): checks new keyframes until several in a row are verified to show
// a known place, distributes the error over the pose graph between them, corrects the map, and fuses points
// that were mapped twice. Each step is short, so that a keyframe never waits for long: the pose graph is
// optimized on a copy of the poses, a few iterations at a time, and the map is then corrected in one step.
// Owned by the mapper and used on its thread only.
class LoopCloser {
 public:
  LoopCloser(const LoopOptions& options, const SearchOptions& search)
      : options_(Checked(options)), detector_(options.detector), searcher_(search) {}

  // Resets everything for another map.
  void Reset();
  // Queues a localized keyframe for the search, after its points were created.
  void Enqueue(KeyFrameId keyframe);

  enum class Progress : std::uint8_t {
    kNothing,  // there was no work
    kWorked,
    kMoved,  // the map was corrected and points were fused
    kFused,  // the last step of a loop: the whole map must be adjusted now
  };
  // Does the most urgent step: continues a loop that was found, or else searches for one, which is less
  // urgent.
  Progress Step(Map* map);
  bool HasLoop() const { return loop_.has_value() || !to_fuse_.empty(); }
  // The loop that the last kMoved step closed.
  const ClosedLoop& last() const { return last_; }

 private:
  // A loop that was found and whose pose graph is being optimized.
  struct Loop {
    std::vector<LoopCandidate> candidates;
    LoopGraph graph;
    int rounds = 0;
  };
  Progress DoStep(Map* map);
  void OptimizePoseGraph(Map* map, Progress* progress);
  bool Close(Map* map);
  void Fuse(Map* map);

  const LoopOptions options_;
  LoopDetector detector_;
  PointSearcher searcher_;  // separate from the mapper's, so that a search without result has no side effects
  std::deque<KeyFrameId> queue_;
  std::optional<Loop> loop_;
  std::vector<KeyFrameId> nearby_;  // keyframes on both sides of the loop that was closed last
  std::deque<KeyFrameId> to_fuse_;
  ClosedLoop last_;
};

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "engine/mapping/loop_correction.h"

namespace docent::engine {

struct LoopOptions {
  bool enabled = true;
  LoopDetectorOptions finder;
  LoopCorrectionOptions correction;
};

// Closes the loops of one map: looks at new keyframes, has the geometry of several in a row prove that they
// show a known place, spreads the error over the way between, moves the map, and makes one of what was mapped
// twice (ptamm §6.2). Each step is short, so that a keyframe never waits for long: the error is spread on a
// copy of the poses, step by step, and the map is then moved at once. The mapper owns it; its thread alone.
class LoopCloser {
 public:
  LoopCloser(const LoopOptions& options, const SearchOptions& search)
      : options_(options), finder_(options.finder), searcher_(search) {}

  // Another map from now on.
  void Begin();
  // A keyframe that is localized, after its points were made.
  void Look(KeyFrameId keyframe);

  enum class Progress : std::uint8_t {
    kNothing,  // there was nothing to do
    kWorked,
    kMoved,  // the map was moved, and points were fused
    kFused,  // the last step of a loop: the map is to be adjusted as a whole
  };
  // The most urgent piece of work: on a loop that was found, else the search for one, which can wait.
  Progress Step(Map* map);
  bool HasFound() const { return loop_.has_value() || !to_fuse_.empty(); }
  // About the loop that the last step with kMoved closed.
  const std::string& report() const { return report_; }
  // Its last keyframe; kNoId before the first.
  KeyFrameId closed_by() const { return closed_by_; }

 private:
  // One that was found, while its error is being spread.
  struct Loop {
    std::vector<LoopCandidate> sightings;
    LoopGraph graph;
    int rounds = 0;
  };
  Progress DoStep(Map* map);
  void OptimizePoseGraph(Map* map, Progress* progress);
  bool Close(Map* map);
  void Fuse(Map* map);

  const LoopOptions options_;
  LoopDetector finder_;
  PointSearcher searcher_;  // its own, so that a search for loops that finds none leaves no trace
  std::deque<KeyFrameId> to_look_;
  std::optional<Loop> loop_;
  std::vector<KeyFrameId> about_;  // keyframes on both sides of where the last loop was closed
  std::deque<KeyFrameId> to_fuse_;
  std::string report_;
  KeyFrameId closed_by_ = kNoId;
};

}  // namespace docent::engine

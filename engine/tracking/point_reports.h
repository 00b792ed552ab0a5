// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "engine/mapping/keyframe_candidate.h"
#include "engine/tracking/map_tracker.h"

namespace docent::engine {

// Counts how the searches for each map point ended, until the mapper takes the counts. Used on the camera's
// thread; does not allocate once it has the size of the map.
class PointReports {
 public:
  // The searches of one frame; each point occurs once.
  void Add(std::span<const MapTracker::Attempt> attempts);
  // The counts since the last call, by ascending point.
  std::vector<PointReport> Take();
  void Clear() { reports_.clear(); }

 private:
  std::vector<PointReport> reports_;  // by ascending point
  std::vector<PointReport> fresh_;    // scratch memory: points of this frame that reports_ did not contain
};

}  // namespace docent::engine

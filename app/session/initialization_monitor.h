// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/tracking/tracked_frame.h"

namespace docent::app {

struct InitializationMonitorOptions {
  // Points without a true depth are lost as soon as the camera moves: after false starts of a real drone and
  // a real hand the found points fell from 330 to 30 in half a second to two seconds. Below this part of the
  // first share, halfway between that and a map that keeps most of its points, the map is taken to be false.
  double min_share_kept = 0.4;
  Timestamp first_share = std::chrono::milliseconds(200);   // over which the first share is measured
  Timestamp recent_share = std::chrono::milliseconds(200);  // and the present one
  // Farther from its first view, in units of the map's depth, or turned farther, a true map may be out of
  // sight.
  double max_distance = 0.3;
  double max_turn = 0.35;  // radians
};

// Watches the first frames that are tracked in a new map with depth and tells whether its depth was false.
// One for each new map; its owner guards it.
class InitializationMonitor {
 public:
  explicit InitializationMonitor(const InitializationMonitorOptions& options = {}) : options_(options) {}

  // Every frame that is tracked in the map, by ascending time. A frame in which the map gave the rotation
  // alone counts as one that found none of its points.
  void Add(const engine::TrackedFrame& frame);
  // Why the map is false; empty while nothing speaks against it.
  std::optional<std::string> Fault() const;

 private:
  struct Sample {
    Timestamp time{};
    double share = 0;
  };
  InitializationMonitorOptions options_;
  std::optional<engine::Rigid3> first_pose_;
  Timestamp first_time_{};
  double depth_ = 1;
  double first_sum_ = 0;
  int first_count_ = 0;
  std::vector<Sample> recent_;
  bool near_ = true;  // the camera still sees about what it saw at first
};

}  // namespace docent::app

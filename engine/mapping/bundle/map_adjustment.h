// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/map/map.h"
#include "engine/mapping/bundle/bundle_adjustment.h"

namespace docent::engine {

struct MapAdjustmentOptions {
  int window = 7;      // keyframes adjusted besides the newest: those that share most points with it
  int max_fixed = 20;  // further observers of their points, held fixed
  int local_iterations = 5;
  int global_iterations = 12;
  // Huber's loss still attracts large residuals, as they occur after a loop was closed.
  RobustLoss global_loss = RobustLoss::kTukey;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Adjusts `keyframe`, the keyframes that share most points with it, and all their points; everything else is
// fixed (ptamm §2.3). Removes outlying observations. Fails if there is no such keyframe. Where the fixed
// keyframes have one centre only, the map keeps its scale: by the distances of the keyframes from it, or of
// the points where there are fewer than ten keyframes.
BundleSummary AdjustLocally(const MapAdjustmentOptions& options, KeyFrameId keyframe,
                            const std::atomic<bool>* interrupt, Map* map);
// The same for every keyframe and point; the keyframes marked `fixed` define the coordinate frame.
BundleSummary AdjustGlobally(const MapAdjustmentOptions& options, const std::atomic<bool>* interrupt,
                             Map* map);

}  // namespace docent::engine

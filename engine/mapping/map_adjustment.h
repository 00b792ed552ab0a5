// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "engine/map/map.h"
#include "engine/mapping/bundle_adjustment.h"

namespace docent::engine {

struct MapAdjustmentOptions {
  int window = 7;      // keyframes adjusted besides the newest: those that share most points with it
  int max_fixed = 20;  // further observers held fixed
  int local_iterations = 5;
  int global_iterations = 12;
  // Huber's still pulls where much is wrong at once, as after a loop was closed.
  RobustLoss global_loss = RobustLoss::kTukey;
};

// Adjusts `keyframe`, the keyframes that share most points with it and all their points, the rest fixed
// (ptamm §2.3). Outlying observations are removed. Nothing changes when the adjustment fails.
BundleSummary AdjustLocally(const MapAdjustmentOptions& options, KeyFrameId keyframe,
                            const std::atomic<bool>* interrupt, Map* map);
// The same with every keyframe and point; the keyframes marked `fixed` hold the frame.
BundleSummary AdjustGlobally(const MapAdjustmentOptions& options, const std::atomic<bool>* interrupt,
                             Map* map);

}  // namespace docent::engine

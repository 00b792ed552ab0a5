// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "maps/library.h"

namespace docent::maps {

// What became of a map that rests (ptamm §3.1: the map maker visits maps that nobody is in).
struct Optimization {
  enum class Outcome {
    kAdjusted,
    kAlreadyBest,
    kNotAllowed,
    kTooSmall,
    kInterrupted,
    kChangedMeanwhile,  // by another program: its work stays
    kFailed
  };
  Outcome outcome = Outcome::kFailed;
  // Of the observations that were there before and stayed: what was found must not make the comparison
  // unfair.
  double rms_before_px = 0, rms_after_px = 0;
  std::size_t points_removed = 0, observations_removed = 0, observations_added = 0, keyframes_removed = 0;
};

// The work on one map, without a library: global adjustment, points found again in the keyframes that should
// see them, adjustment again, redundant keyframes taken out. Pure; `interrupt` may be null.
struct AdjustedMap {
  Optimization optimization;
  std::shared_ptr<const engine::MapSnapshot> snapshot;  // of kAdjusted alone
};
AdjustedMap AdjustIdleMap(const engine::MapSnapshot& map, const std::atomic<bool>* interrupt);

// What stands in a map, taken along with its ground from one state of the map to another; null where nothing
// moves. Only the content floor can do that.
using MoveScene = std::function<std::shared_ptr<const SceneRecord>(
    const SceneRecord& scene, const engine::MapSnapshot& before, const engine::MapSnapshot& after)>;

// Does that to a map of a library, and saves it where that changed anything. The policy must allow that its
// structure changes. `interrupt` may be null; a map whose adjustment was interrupted stays as it was. The
// library makes full features. Throws docent::Error for what the file has wrong.
Optimization OptimizeMap(Library* library, std::uint64_t key, const std::atomic<bool>* interrupt,
                         const MoveScene& move_scene = {});

// Root mean square distance between where points were seen and where they should be, pixels of level 0:
// of the observations of finite points that project and that `counted` has too. 0 when there is none.
double ReprojectionRms(const engine::MapSnapshot& map, const engine::MapSnapshot& counted);

}  // namespace docent::maps

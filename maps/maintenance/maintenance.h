// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "maps/library/library.h"

namespace docent::maps {

// The result of optimizing an idle map (ptamm §3.1: the map maker visits maps that no camera is in).
struct Optimization {
  enum class Outcome {
    kAdjusted,
    kAlreadyOptimal,
    kNotAllowed,
    kTooSmall,
    kInterrupted,
    kChangedMeanwhile,  // Changed by another program, whose work is kept.
    kFailed
  };
  Outcome outcome = Outcome::kFailed;
  // Reprojection RMS of the observations that exist both before and after, so that observations that were
  // added do not distort the comparison.
  double rms_before_px = 0, rms_after_px = 0;
  std::size_t points_removed = 0, observations_removed = 0, observations_added = 0, keyframes_removed = 0;
};

// Optimizes one map without a library: global bundle adjustment, guided matching of map points in all
// keyframes, a second bundle adjustment if that added observations, and culling of redundant keyframes. A
// pure function; `interrupt` may be null.
struct AdjustedMap {
  Optimization optimization;
  std::shared_ptr<const engine::MapSnapshot> snapshot;  // Set only if the outcome is kAdjusted.
};
AdjustedMap AdjustIdleMap(const engine::MapSnapshot& map, const std::atomic<bool>* interrupt);

// The content of a map and the changes of it that can be undone; null where there is nothing.
struct StoredContent {
  std::shared_ptr<const SceneRecord> scene, history;
};
// Moves the content of a map with its anchors from one state of the map to another; returns nothing if
// nothing moves. Only the content library can do that.
using MoveScene = std::function<StoredContent(const StoredContent& content, const engine::MapSnapshot& before,
                                              const engine::MapSnapshot& after)>;

// Applies AdjustIdleMap to a map of a library and saves the result if the map changed. Returns kNotAllowed if
// the policy forbids changes to keyframes and points. `interrupt` may be null; an interrupted map stays
// unchanged. The library must be opened with full feature computation. Throws docent::Error when the file has
// an error.
Optimization OptimizeMap(Library* library, std::uint64_t key, const std::atomic<bool>* interrupt,
                         const MoveScene& move_scene = {});

// The root mean square reprojection error in pixels of level 0, over the observations of finite points that
// project into their keyframe and that `counted` contains too. Returns 0 if there are none.
double ReprojectionRms(const engine::MapSnapshot& map, const engine::MapSnapshot& counted);

}  // namespace docent::maps

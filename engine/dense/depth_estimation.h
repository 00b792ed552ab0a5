// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/dense/depth_map.h"
#include "engine/dense/depth_views.h"
#include "engine/dense/semi_global.h"

// Dense depth of the keyframes of a map: a plane sweep over neighbouring keyframes, semi-global matching, and
// a check of the results against each other. Works with every lens model. Deterministic.
namespace docent::engine {

struct DepthOptions {
  DepthViewOptions views;
  int max_width_px = 400;  // The finest pyramid level that is not wider than this is used.
  int max_planes = 128;    // Bounds time and memory: bytes of a keyframe = 3 x pixels x planes.
  SmoothnessCosts smoothness;
  int min_confidence = 8;  // Of 255; see PlaneChoice.
  // A depth is kept if this many neighbours confirm it, or if one does and none sees something behind it.
  int min_agreeing = 2;
  // Two inverse distances agree if they differ by less than this ratio plus a plane of the sweep.
  double agreement = 0.02;
  int min_region_px = 24;  // Smaller connected regions of depth are removed.

  // Describes the first invalid option, or empty.
  std::optional<std::string> Validate() const;
};

// Estimates the depths of keyframes one by one. One thread at a time.
class DepthEstimator {
 public:
  // Throws Error if the options are invalid.
  explicit DepthEstimator(std::shared_ptr<const MapSnapshot> map, const DepthOptions& options = {});

  // The keyframes whose depth can be estimated.
  const std::vector<DepthViews>& views() const { return views_; }
  // The depth of one of views(), not checked against others. Empty when asked to stop.
  std::optional<DepthMap> Estimate(const DepthViews& views, const std::atomic<bool>* interrupt = nullptr);
  // The depth map without the depths that too few of `others` confirm, its neighbours (some may be missing or
  // null). A neighbour that sees something nearer, as beside an object, or has no depth there says nothing.
  DepthMap KeepConsistent(const DepthMap& depth, const std::vector<const DepthMap*>& others) const;

 private:
  std::shared_ptr<const LevelRays> RaysOf(const KeyFrame& keyframe);

  std::shared_ptr<const MapSnapshot> map_;
  DepthOptions options_;
  std::vector<DepthViews> views_;
  // One for each camera; none for images that a rolling shutter exposed while the camera turned.
  std::vector<std::pair<CameraModel, std::shared_ptr<const LevelRays>>> rays_;
};

}  // namespace docent::engine

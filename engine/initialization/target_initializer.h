// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "engine/base/random.h"
#include "engine/initialization/corner_tracks.h"
#include "engine/initialization/hint.h"
#include "engine/initialization/initial_pair.h"
#include "engine/initialization/planar_target.h"

namespace docent::engine {

struct TargetStartOptions {
  double min_parallax_deg = 3.0;        // median over the points of the target
  int min_matches = 50;                 // triangulated, on the target and beside it
  double max_residual_px = 2.0;         // of a triangulated point in either view, pixels of the level
  double min_point_parallax_deg = 1.0;  // of a point beside the target; below it the depth is too uncertain

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Two views in which a target was detected: they initialize a map in metres.
struct TargetStart {
  // The same as from two views alone: |translation| = 1, and the points in that unit; pair.baseline_m gives
  // the unit in metres.
  InitialPair pair;
  Rigid3 a_from_target;  // metres
};

// A view and the detection of the target in it.
struct TargetView {
  InitialPair::View view;
  TargetDetection detection;
};
// Initializes a map from two views: points of the target that both views detect, placed on its plane, and
// triangulated corners beside it. Empty if there is too little parallax or there are too few points; *hint
// then says what to do.
std::optional<TargetStart> MakeTargetStart(const std::shared_ptr<const CameraModel>& camera,
                                           const TargetView& a, const TargetView& b,
                                           const std::vector<InitialPair::Match>& tracked,
                                           const TargetStartOptions& options, Hint* hint);

// Detects the target, tracks the camera from it, and tracks corners in the whole image, until two views can
// initialize a map (hybrid-slam §5.5). Takes the place of an Initializer and is used in the same way: one per
// camera, on the tracker's thread.
class TargetInitializer {
 public:
  TargetInitializer(std::shared_ptr<const PlanarTarget> target, const TargetStartOptions& options,
                    std::shared_ptr<const CameraModel> camera, std::uint64_t seed);

  // Starts again from the next frame.
  void Reset();
  // Returns a start once it is reliable, and then resets itself.
  std::optional<TargetStart> Track(Timestamp time, const std::shared_ptr<const ImageFeatures>& features);

  // Time of the first view; Timestamp::min() if there is none.
  Timestamp first_time() const { return first_ ? first_->view.time : Timestamp::min(); }
  // Why there is no map yet.
  Hint hint() const { return hint_; }
  // The detection in the last frame; empty if the target was not found there.
  const std::optional<TargetDetection>& detection() const { return detection_; }

 private:
  std::optional<TargetDetection> DetectOrAlign(const ImageFeatures& features);

  std::shared_ptr<const PlanarTarget> target_;
  TargetStartOptions options_;
  std::shared_ptr<const CameraModel> camera_;
  Random random_;
  CornerTracks corner_tracks_;
  std::optional<TargetView> first_;
  std::optional<TargetDetection> detection_;
  std::shared_ptr<const ImageFeatures> previous_;
  Hint hint_ = Hint::kNone;
};

}  // namespace docent::engine

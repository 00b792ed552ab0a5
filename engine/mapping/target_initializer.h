// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "engine/mapping/initializer.h"
#include "engine/mapping/keyframe_candidate.h"
#include "engine/mapping/planar_target.h"

namespace docent::engine {

struct TargetStartOptions {
  double min_parallax_deg = 3.0;        // median over the target's points
  int min_matches = 50;                 // triangulated, on the target and beside it
  double max_residual_px = 2.0;         // of a triangulated point, in either view, times 2^level
  double min_point_parallax_deg = 1.0;  // of a point beside the target: below it depth is a guess
};

// Two views in which a target was seen: the start of a map in metres.
struct TargetStart {
  // As from two views alone: |translation| = 1, and the points in that unit; pair.baseline_m tells the unit.
  InitialPair pair;
  Rigid3 a_from_target;  // metres
};

// A view, where the target was in it, and its corners that were followed to the other view.
struct TargetView {
  InitialPair::View view;
  TargetDetection sighting;
};
// The start that two views give: points of the target that both saw, where the plane says they are, and
// followed corners beside it, triangulated. Empty where parallax or points are too few; *hint then says what
// the person can do.
std::optional<TargetStart> MakeTargetStart(const std::shared_ptr<const CameraModel>& camera,
                                           const TargetView& a, const TargetView& b,
                                           const std::vector<InitialPair::Match>& followed,
                                           const TargetStartOptions& options, std::string* hint);

// Waits for the target, tracks the camera from it, and follows corners all over the image beside it, until
// two views start a map (hybrid-slam §5.5). Used like an Initializer, in its place: one a camera, on the
// tracker's thread.
class TargetInitializer {
 public:
  TargetInitializer(std::shared_ptr<const PlanarTarget> target, const TargetStartOptions& options,
                    std::shared_ptr<const CameraModel> camera, std::uint64_t seed);

  // Starts again from the next frame.
  void Reset();
  // A start once it is certain; then Reset() has happened.
  std::optional<TargetStart> Track(Timestamp time, const std::shared_ptr<const ImageFeatures>& features);

  // Of the first view that is waited with; far in the past when there is none.
  Timestamp first_time() const { return first_ ? first_->view.time : Timestamp::min(); }
  // Why there is no map so far.
  const std::string& hint() const { return hint_; }
  // Where the target was in the last frame; empty when it was not seen there.
  const std::optional<TargetDetection>& sighting() const { return sighting_; }
  // Corners being followed since the first view.
  const std::vector<Initializer::Trail>& trails() const { return follower_.trails(); }

 private:
  std::optional<TargetDetection> Sight(const ImageFeatures& features);

  std::shared_ptr<const PlanarTarget> target_;
  TargetStartOptions options_;
  std::shared_ptr<const CameraModel> camera_;
  Random random_;
  Initializer follower_;  // of corners; never asked for a pose
  std::optional<TargetView> first_;
  std::optional<TargetDetection> sighting_;
  std::shared_ptr<const ImageFeatures> previous_;
  std::string hint_;
};

}  // namespace docent::engine

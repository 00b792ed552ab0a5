// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "engine/base/time.h"
#include "engine/geometry/rigid3.h"
#include "engine/tracking/map_tracker.h"
#include "engine/tracking/tracker_options.h"

namespace docent::engine {

// Whether the map that a camera relocalized in may be extended: only after enough frames have confirmed the
// pose (ptamm §6.3) and explain most of what is in view, because the furniture of one room may fit another
// one too. Sees every accepted pose of the tracker that owns it.
class RelocalizationConfirmation {
 public:
  explicit RelocalizationConfirmation(const TrackerOptions& options) : options_(options) {}

  // Nothing waits for confirmation.
  void Reset() { unconfirmed_frames_ = 0; }
  // The visible inlier ratio is unknown in another map.
  void EnterOtherMap() { mean_visible_inlier_ratio_ = 1; }
  // A loss and the pose that ended it.
  struct Loss {
    Timestamp duration{};
    Rigid3 lost, found;       // camera_from_map
    double median_depth = 1;  // map units
  };
  // A pose was found after a loss, or in another map.
  void Begin(const MapTrackResult& found, const Loss& loss);
  // The frames of the hypothesis confirm a pose near the lost one already.
  void CountHypothesis();
  // The next pose of the track. good: its tracking quality is good. Returns whether the map may be extended.
  bool Add(const MapTrackResult& result, bool good);

  bool is_pending() const { return unconfirmed_frames_ > 0; }
  double visible_inlier_ratio() const { return visible_inlier_ratio_; }  // of the last pose

 private:
  double RequiredInlierRatio(const Loss& loss) const;

  TrackerOptions options_;
  // Frames that still have to explain the image before the map is extended.
  int unconfirmed_frames_ = 0;
  double required_inlier_ratio_ = 0;  // visible inlier ratio that such a frame needs
  double visible_inlier_ratio_ = 0;
  double mean_visible_inlier_ratio_ = 1;  // exponential average over about ten frames
};

}  // namespace docent::engine

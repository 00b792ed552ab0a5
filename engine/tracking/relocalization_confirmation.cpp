// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/relocalization_confirmation.h"

#include <algorithm>

namespace docent::engine {

// The visible inlier ratio that a frame needs after a relocalization to count towards extending the map. A
// camera that is found shortly after the loss near the lost pose has hardly reached another place of similar
// appearance. With many occlusions the ratio was never high, and the motion that lost the camera brought
// parts into view that the map lacks; then half of the ratio from before the loss suffices.
double RelocalizationConfirmation::RequiredInlierRatio(const Loss& loss) const {
  // Ratio of the median depth, and radians: half the field of view of a 60 degree lens.
  constexpr double kNear = 0.5;
  // A phone in a corridor explained 0.53 before the loss and 0.25 to 0.39 after it; a bay that has only a
  // cabinet in common with the mapped one is explained by 0.17.
  constexpr double kLargestDrop = 2;
  const double shift = (loss.lost.OriginInSource() - loss.found.OriginInSource()).norm();
  const double angle = (loss.lost.rotation * loss.found.rotation.inverse()).Angle();
  if (loss.duration > FromSeconds(options_.short_loss_s) || shift > kNear * loss.median_depth ||
      angle > kNear)
    return options_.poor_visible_ratio;
  return std::min(options_.poor_visible_ratio, mean_visible_inlier_ratio_ / kLargestDrop);
}

void RelocalizationConfirmation::Begin(const MapTrackResult& found, const Loss& loss) {
  unconfirmed_frames_ = options_.confirming_frames;
  required_inlier_ratio_ = RequiredInlierRatio(loss);
  visible_inlier_ratio_ = found.VisibleInlierRatio();
}

void RelocalizationConfirmation::CountHypothesis() {
  if (required_inlier_ratio_ < options_.poor_visible_ratio) unconfirmed_frames_ = 1;
}

bool RelocalizationConfirmation::Add(const MapTrackResult& result, bool good) {
  constexpr double kDecay = 0.9;  // weight of the previous average
  visible_inlier_ratio_ = result.VisibleInlierRatio();
  if (unconfirmed_frames_ > 0) {
    if (!good) unconfirmed_frames_ = options_.confirming_frames;
    if (visible_inlier_ratio_ >= required_inlier_ratio_) --unconfirmed_frames_;
    return false;
  }
  if (result.inliers > 0)
    mean_visible_inlier_ratio_ = kDecay * mean_visible_inlier_ratio_ + (1 - kDecay) * visible_inlier_ratio_;
  return true;
}

}  // namespace docent::engine

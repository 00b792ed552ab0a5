// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "engine/geometry/readout_prior.h"
#include "engine/mapping/bundle/bundle_adjustment.h"

namespace docent::engine {

// The rotation rates of keyframes are not adjusted, so that their errors are those of the readout time: its
// error is so many times as large as if all errors were independent.
inline constexpr double kReadoutRateErrors = 3;

struct ReadoutEstimationOptions {
  bool enabled = true;
  // Standard deviation of the readout time before anything is known, seconds. Phones take 28 to 61 ms
  // (Ringaby and Forssen 2012), webcams about as long, a global shutter none.
  double prior_sigma_s = 0.03;
  // From other measurements, such as those of the initialization or of earlier windows; instead of zero with
  // prior_sigma_s. Then the measurements count kReadoutRateErrors squared times less.
  std::optional<ReadoutPrior> prior = std::nullopt;
  // Standard deviation of the errors that all images of one problem have in common, besides those. In a fast
  // pan the newest keyframes gave 17, 16, 14 and 12 ms instead of 18.5.
  double common_sigma_s = 0.004;
  // A readout time is used once it differs from zero by this many standard deviations and seconds. Errors of
  // a calibration looked like up to 3.5 ms in real recordings; this is twice that. A faster shutter counts as
  // global.
  double min_sigmas = 4;
  double min_readout_s = 0.007;
  // From then on a change is followed if it is at least this and at least its standard deviation.
  double min_change_s = 0.001;
  double max_readout_s = 0.07;  // no camera takes longer
  double min_rate = 0.1;        // radians per second; slower rotations do not determine it
  int min_measurements = 200;   // in images that rotated

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// The readout time that fits a bundle problem best if columns are exposed one after another, and if rows are;
// see ReadoutMotion.
struct ReadoutEstimate {
  Eigen::Vector2d readout_s = Eigen::Vector2d::Zero();
  Eigen::Vector2d sigma_s = Eigen::Vector2d::Zero();  // standard deviations, if all errors are independent
};

// Estimates the readout time that all cameras with a nonzero entry in `of_lens` share, together with the free
// cameras and all points of the problem: one Gauss-Newton step, with cameras and points eliminated (Triggs et
// al., "Bundle Adjustment - A Modern Synthesis", 2000, section 6). A wrong readout time leaves residuals that
// grow with the rotation rate and with the distance from the middle row, which no camera and no point
// explains. Each camera keeps its rotation rate. Empty if there are too few measurements. Deterministic.
std::optional<ReadoutEstimate> EstimateReadout(const ReadoutEstimationOptions& options,
                                               const std::vector<char>& of_lens,
                                               const BundleProblem& problem);

}  // namespace docent::engine

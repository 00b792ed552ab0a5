// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "engine/mapping/bundle/bundle_adjustment.h"

// Bundle adjustment with an unknown calibration: the focal length and the radial coefficient k1, and
// optionally k2 and the principal point, are estimated together with poses and points (Triggs et al., "Bundle
// Adjustment - A Modern Synthesis", 2000, section 10 on self-calibration).
namespace docent::engine {

// A lens with square pixels, the principal point at the image centre, no distortion, and this field of view
// across the longer side (a phone may be held upright), degrees.
CameraModel LensWithFieldOfView(int width_px, int height_px, double degrees);
// The same with a given focal length in pixels and coefficient k1 of the radial-tangential model.
CameraModel LensWithFocalLength(int width_px, int height_px, double focal_px, double k1);

struct SelfCalibrationOptions {
  // Fields of view, degrees across the longer side, from which the optimization starts in addition to the
  // current lens. All measurements were selected with that lens, and the cost has several local minima.
  std::vector<double> fields_of_view_deg = {};
  int trial_iterations = 10;  // from each of these
  int max_iterations = 40;    // from the best of them
  // Standard deviation of the prior of k1. The calibrations of the sequences used for development lie between
  // -0.3 and 0.2.
  double k1_prior_sigma = 0.3;
  // Standard deviations of the priors of k2, and of the principal point about the image centre relative to
  // the longer side. 0: not estimated. They are needed for a strongly distorted lens whose principal point
  // lies a per cent from the centre; the focal length would be biased otherwise (see LensEstimationOptions).
  double k2_prior_sigma = 0, center_prior_sigma = 0;
  bool refine_lens =
      true;  // false: only poses and points are adjusted, to a lens that the caller has changed
  const std::atomic<bool>* interrupt = nullptr;  // may be null

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

struct SelfCalibration {
  enum class Outcome {
    kDone,
    kInterrupted,  // the problem is unchanged
    kFailed        // too few measurements, or no plausible lens was found; the problem is unchanged
  };
  Outcome outcome = Outcome::kFailed;
  CameraModel lens;
  double focal_px = 0;  // of `lens`
  // Standard deviations of the focal length, relative to it, and of k1. Errors of the same point and of the
  // same keyframe may be correlated (variance clustered both ways: Cameron, Gelbach and Miller, "Robust
  // Inference with Multiway Clustering", 2011). Errors of the lens model are not included.
  double focal_sigma = 0, k1_sigma = 0;
  // The relative standard deviation of the focal length if all errors were independent.
  double formal_focal_sigma = 0;
  double sigma = 0;  // robust standard deviation of the normalized residuals along one axis
  double cost = 0;   // half the sum of the robust losses
  int iterations = 0;
};

// Adjusts cameras, points and the lens that all cameras with a nonzero entry in `unknown` share. On kDone the
// models of these cameras are replaced by the new lens. All points and all cameras that are not `fixed` are
// adjusted; if no camera is fixed, the first one is. The scale is set so that the points seen by the first
// fixed camera keep their median distance from its optical axis. Indices have to be valid; the models of the
// unknown cameras have to be radial-tangential with fx = fy, and only k1 and k2 may be nonzero. Deterministic
// and single-threaded.
SelfCalibration CalibrateBundle(const SelfCalibrationOptions& options, const std::vector<char>& unknown,
                                BundleProblem* problem);

}  // namespace docent::engine

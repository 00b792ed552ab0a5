// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "app/evaluation/ground_truth.h"
#include "app/session/calibrated_camera.h"
#include "app/simulator/simulation.h"

// Measures the true depth of the scene at given pixels of a frame from the ground-truth camera poses: the
// pixels are tracked through the following images by optical flow (pyramidal Lucas-Kanade), and each pixel is
// triangulated from all of these images with the true camera centres. The orientations are optimized within
// their uncertainty. No part of the engine is used.
//
// The result is inverse depth, because a camera that has moved little can tell that a scene is far, but not
// how far. With a baseline b, an orientation error of an angle a changes the inverse depth by a / b, and an
// error n of the centres changes it by n / b times its value. Both errors are nearly equal for all pixels, so
// averaging over pixels does not reduce them.
namespace docent::app {

struct TrueDepthOptions {
  Timestamp max_duration = std::chrono::seconds(5);  // Maximum time that pixels are tracked.
  double min_tracked_ratio = 0.2;  // Tracking ends when fewer of the pixels are still tracked.
  int images = 12;                 // Images used for triangulation, evenly spaced over the tracked ones.
  double pixel_sigma = 0.5;        // Of a tracked pixel; typical for Lucas-Kanade over a second or more.
  // Standard deviation of the true orientations: motion capture and the trackers of depth cameras are
  // accurate to a few tenths of a degree, and clocks that differ by 5 ms add half a degree at a rotation of
  // 100 degrees/s.
  double orientation_sigma_deg = 0.5;
  double truth_noise_m = 0.01;  // Standard deviation of a true centre, for each coordinate.
  double max_error_px = 2;      // Maximum RMS residual; a pixel above it was lost by the optical flow.
  Timestamp max_time_difference = std::chrono::milliseconds(10);

  // Describes the first invalid option, or empty.
  std::optional<std::string> Validate() const;
};

// Inverse depth along the optical axis of the frame, 1 / metres, and its standard deviation.
struct TrueDepth {
  double inverse = 0, sigma = 0;
};
// One for each pixel; empty when the pixel could not be tracked.
using TrueDepths = std::vector<std::optional<TrueDepth>>;

// Measures depths at pixels of the next image that `camera` delivers, and reads further images from it. One
// thread. Throws Error when the source fails or the options are invalid.
TrueDepths MeasureTrueDepths(CalibratedCamera* camera, const std::vector<TimedPose>& truth,
                             const std::vector<Eigen::Vector2f>& pixels,
                             const TrueDepthOptions& options = {});

// Returns the exact depths of a simulation.
TrueDepths SimulatedTrueDepths(const Simulation& simulation, int frame,
                               const std::vector<Eigen::Vector2f>& pixels);

}  // namespace docent::app

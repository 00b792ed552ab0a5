// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "app/evaluation/ground_truth.h"
#include "app/session/calibrated_camera.h"
#include "app/simulator/simulation.h"

// How far away the scene truly is at pixels of a frame, where the true poses of the camera are known and
// nothing else is: the pixels are followed through the images that come after by optical flow (pyramidal
// Lucas-Kanade), and each is triangulated in all of them at once, with the true centres. The true
// orientations are free within their error. Nothing of the engine has a part in it.
//
// What is told is inverse depth, since a camera that has moved little knows that a scene is far, but not how
// far: with centres that are b apart, an orientation that is wrong by an angle moves the inverse depth by
// that angle over b, and centres that are wrong by n move it by n / b of itself. Both errors are much the
// same for all pixels and do not become less with their number.
namespace docent::app {

struct TrueDepthOptions {
  Timestamp longest = std::chrono::seconds(5);  // that pixels are followed
  double least_kept = 0.2;                      // of the pixels, or following ends
  int images = 12;                              // that are used of those followed, evenly over the way
  double pixel_sigma = 0.5;                     // of a followed pixel; Lucas-Kanade's over a second or more
  // Of the truth: motion capture and depth cameras' trackers are good for a few tenths of a degree, and
  // clocks that differ by 5 ms add half a degree in a turn of 100 degrees a second.
  double orientation_sigma_deg = 0.5;
  double truth_noise_m = 0.01;  // of a true centre, each coordinate
  double largest_error_px = 2;  // root mean square of a pixel's residuals, or it was lost by the flow
  Timestamp max_time_difference = std::chrono::milliseconds(10);

  // A sentence that says what is wrong, or empty.
  std::optional<std::string> Validate() const;
};

// Inverse depth along the optical axis of the frame, 1 / metres, and its standard deviation.
struct TrueDepth {
  double inverse = 0, sigma = 0;
};
// One for each pixel; empty where it could not be followed.
using TrueDepths = std::vector<std::optional<TrueDepth>>;

// The pixels are of the first image that `camera` delivers from here on. One thread; reads the source on.
// Throws Error where the source breaks or the options are not valid.
TrueDepths FollowTrueDepths(CalibratedCamera* camera, const std::vector<TimedPose>& truth,
                            const std::vector<Eigen::Vector2f>& pixels, const TrueDepthOptions& options = {});

// The same of a simulation, which knows its surfaces.
TrueDepths SimulatedTrueDepths(const Simulation& simulation, int frame,
                               const std::vector<Eigen::Vector2f>& pixels);

}  // namespace docent::app

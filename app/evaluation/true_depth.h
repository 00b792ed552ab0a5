// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "app/evaluation/ground_truth.h"
#include "app/session/calibrated_camera.h"
#include "app/simulator/simulation.h"

// How far away the scene truly is at pixels of a frame, where the true poses of the camera are known and
// nothing else is: the pixels are followed through the images that come after by optical flow (pyramidal
// Lucas-Kanade), and each is triangulated in all of them at once, with the true centres. The true
// orientations are free within their error, since that of a motion capture system or a depth camera's
// tracker, a few tenths of a degree, is what would limit the depth otherwise. Nothing of the engine has a
// part in it.
namespace docent::app {

struct TrueDepthOptions {
  Timestamp longest = std::chrono::seconds(5);  // that pixels are followed
  double least_kept = 0.4;                      // of the pixels, or following ends
  int images = 12;                              // that are used of those followed, evenly over the way
  double pixel_sigma = 0.5;                     // of a followed pixel; Lucas-Kanade's over a second or more
  double orientation_sigma_deg = 0.5;           // of the truth, with what the clocks differ in a fast turn
  double truth_noise_m = 0.01;                  // of a true centre
  // A depth counts when the true centres that saw it are so many times the noise apart ...
  double least_noises = 10;
  // ... and their rays meet at so large an angle: a tenth of a degree that is left of the orientation error
  // is then a tenth of the depth at most.
  double least_parallax_deg = 1.5;
  double largest_error_px = 2;  // root mean square of a pixel's residuals, or it was lost by the flow
  Timestamp max_time_difference = std::chrono::milliseconds(10);

  // A sentence that says what is wrong, or empty.
  std::optional<std::string> Validate() const;
};

// Along the optical axis of the frame, in metres, one for each pixel; empty where it cannot be told.
using TrueDepths = std::vector<std::optional<double>>;

// The pixels are of the first image that `camera` delivers from here on. One thread; reads the source on.
// Throws Error where the source breaks or the options are not valid.
TrueDepths FollowTrueDepths(CalibratedCamera* camera, const std::vector<TimedPose>& truth,
                            const std::vector<Eigen::Vector2f>& pixels, const TrueDepthOptions& options = {});

// The same of a simulation, which knows its surfaces.
TrueDepths SimulatedTrueDepths(const Simulation& simulation, int frame,
                               const std::vector<Eigen::Vector2f>& pixels);

}  // namespace docent::app

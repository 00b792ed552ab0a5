// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "engine/tracking/tracked_frame.h"

// Detects a calibration that does not fit the lens, from the reprojection errors of tracking.
namespace docent::engine {

struct CalibrationMonitorOptions {
  int frames_between_samples = 3;
  double rotation_between_samples_deg = 2;  // a camera that stands still repeats the same errors
  std::size_t min_matches = 60;             // matches of the two finest pyramid levels required in a frame
  std::size_t min_ring_matches = 6;         // matches required in a ring for its median to be used
  std::size_t min_samples = 15;             // frames required of a ring for an estimate of its sigma
  std::size_t min_rings = 4;                // rings with min_samples required for a warning
  // Pixels between the ring with the largest mean radial error and the one with the smallest. Correct
  // calibrations were measured to leave 0.1 (rendered) to 0.2 (recorded), a focal length that is 5 % off 0.4
  // and more.
  double warning_px = 0.3;
  double warning_sigmas = 5;  // the difference must also exceed this many of its standard deviations

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Monitors one camera. With the correct calibration, reprojection errors are unbiased everywhere in the
// image. With a wrong focal length or a missing distortion, no pose fits the centre and the border at once:
// points at one distance from the principal point are found too far out and those at another too far in, in
// every image and whatever the scene. The radial errors are therefore averaged in rings about the principal
// point; noise, outliers and moving people average out, as their errors change sign.
//
// Samples few frames and keeps a few numbers. One thread at a time.
class CalibrationMonitor {
 public:
  static constexpr std::size_t kRings = 6;  // of equal width; the last one ends in the farthest corner
  struct Ring {
    std::size_t samples = 0;  // frames in which the ring had enough matches
    double mean_px = 0;       // mean over the frames of the median radial error, outwards positive
    double sigma_px = 0;      // standard deviation of the frames' medians
  };
  using Profile = std::array<Ring, kRings>;

  explicit CalibrationMonitor(std::shared_ptr<const CameraModel> camera,
                              const CalibrationMonitorOptions& options = {});

  // To be called with every frame of the camera, in order.
  void Add(const TrackedFrame& frame);
  const Profile& profile() const { return profile_; }
  // Where points are seen farthest out and farthest in of where the calibration expects them, in pixels.
  struct Mismatch {
    double outward_radius_px = 0, outward_px = 0;  // distance from the principal point, and mean error there
    double inward_radius_px = 0, inward_px = 0;
  };
  // Returned once, when the calibration was found not to fit the lens.
  std::optional<Mismatch> TakeMismatch();

 private:
  struct Sums {
    double sum = 0, sum_squares = 0;
  };
  void Sample(const TrackedFrame& frame);
  void Evaluate();

  const std::shared_ptr<const CameraModel> camera_;
  const CalibrationMonitorOptions options_;
  double ring_width_px_ = 1;
  int frames_since_ = 0;
  std::optional<Rotation3> sampled_at_;
  std::array<std::vector<double>, kRings> residuals_;  // radial errors by ring; kept to reuse their memory
  std::array<Sums, kRings> sums_;
  Profile profile_;
  bool is_reported_ = false;
  std::optional<Mismatch> mismatch_;
};

}  // namespace docent::engine

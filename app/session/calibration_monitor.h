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

// Whether a calibration is the lens's own, by what tracking leaves over.
namespace docent::app {

struct CalibrationMonitorOptions {
  int frames_between_samples = 3;
  double turn_between_samples_deg = 2;  // a camera that stands still sees the same errors again
  std::size_t min_matches = 60;         // of a frame, found points of the two finest levels
  std::size_t min_ring_matches = 6;     // of a ring in a frame
  std::size_t min_samples = 15;  // of a ring, for its spread to be known; told_sigmas weighs how few they are
  std::size_t min_rings = 4;     // that count, for anything to be said
  // Between the ring found farthest out and the one farthest in. Right lenses were seen to leave 0.1
  // (rendered) to 0.2 (recorded) of it, a focal length that is 5 % off 0.4 and more.
  double told_px = 0.3;
  double told_sigmas = 5;  // of that difference, so that chance does not tell it
};

// Watches one camera. With the right lens, points are found about where they are expected, evenly to all
// sides, wherever in the image they are. With a wrong focal length or a distortion left out, no pose fits
// the middle and the rim at once: points at one distance from the middle are found too far out and those at
// another too far in, in every image again and whatever is seen. So the errors towards the rim are averaged
// by rings about the principal point; what noise, bad points and other people's motion leave there goes to
// nothing with time, as it changes its sign.
//
// Appearance at few frames and keeps a few numbers. One thread at a time.
class CalibrationMonitor {
 public:
  static constexpr std::size_t kRings = 6;  // of equal width, the last one ends in the farthest corner
  struct Ring {
    std::size_t samples = 0;  // frames
    double mean_px = 0;       // outwards, of the frames' medians
    double sigma_px = 0;      // standard deviation of the frames' medians
  };
  using Profile = std::array<Ring, kRings>;

  explicit CalibrationMonitor(std::shared_ptr<const engine::CameraModel> camera,
                              const CalibrationMonitorOptions& options = {});

  // Every frame of the camera, in order.
  void Add(const engine::TrackedFrame& frame);
  const Profile& profile() const { return profile_; }
  // A sentence once the lens is seen to be another one than the calibration says; given out once.
  std::optional<std::string> TakeWarning();

 private:
  struct Sums {
    double sum = 0, sum_squares = 0;
  };
  void Sample(const engine::TrackedFrame& frame);
  void Judge();

  const std::shared_ptr<const engine::CameraModel> camera_;
  const CalibrationMonitorOptions options_;
  double ring_width_px_ = 1;
  int frames_since_ = 0;
  std::optional<engine::Rotation3> sampled_at_;
  std::array<std::vector<double>, kRings> residuals_;  // scratch
  std::array<Sums, kRings> sums_;
  Profile profile_;
  bool told_ = false;
  std::optional<std::string> warning_;
};

}  // namespace docent::app

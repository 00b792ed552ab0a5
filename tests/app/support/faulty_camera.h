// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/random.h"
#include "tests/app/support/simulated_session.h"

// Simulated sequences with the faults of real cameras, and a measure of how well a new map agrees with the
// ground truth. For property tests: every property must hold for all seeds.
namespace docent::app::faulty_camera {

// A hand-held webcam of 320x240 pixels with a rolling shutter, calibration errors of the focal length and
// distortion (whose signs depend on the seed), hand tremor, signal-dependent noise, exposure jumps and
// dropped frames.
inline SimulationOptions Options(std::uint64_t seed, double seconds) {
  Random random(seed);
  const auto sign = [&] { return random.Uniform() < 0.5 ? -1 : 1; };
  SimulationOptions options;
  options.camera = SimulatedCamera(320);
  options.duration_s = seconds;
  options.seed = seed;
  options.faults.readout_s = 0.025;
  options.faults.focal_error = 0.01 * sign();
  options.faults.distortion_error_px = 0.5 * sign();
  options.faults.gain_noise_sigma = 2;
  options.faults.exposure_jump_stops = 0.5;
  options.faults.dropped_share = 0.02;
  options.faults.tremor_deg = 0.1;
  return options;
}

inline std::shared_ptr<const Simulation> Sequence(const std::string& scene, std::uint64_t seed,
                                                  double seconds) {
  return MakeSimulation(scene, Options(seed, seconds));
}

// The start of one map with finite points: its first frame with a pose, and the error of its first second.
struct Start {
  std::size_t frame = 0;
  double path_m = 0;   // true path length of the camera within that second
  double error_m = 0;  // RMS error of the camera centres after alignment with a similarity
};

// The start of every map in which frames were tracked with finite points for at least half a second, in the
// order of their first frames.
inline std::vector<Start> StartsOf(const simulated_session::Seen& seen, const Simulation& simulation) {
  std::map<std::uint64_t, std::vector<std::size_t>> frames_of_map;
  for (std::size_t i = 0; i < seen.frames.size(); ++i) {
    const engine::TrackedFrame& frame = seen.frames[i];
    if (!engine::HasPose(frame.state) || frame.finite_points == 0) continue;
    std::vector<std::size_t>& frames = frames_of_map[frame.map_key];
    const auto begin = frames.empty() ? frame.frame.time : seen.frames[frames.front()].frame.time;
    if (frame.frame.time - begin <= std::chrono::seconds(1)) frames.push_back(i);
  }
  std::vector<Start> starts;
  for (const auto& [key, frames] : frames_of_map) {
    const Timestamp length = seen.frames[frames.back()].frame.time - seen.frames[frames.front()].frame.time;
    if (length < std::chrono::milliseconds(500)) continue;
    const auto count = static_cast<Eigen::Index>(frames.size());
    Eigen::Matrix3Xd tracked(3, count), truth(3, count);
    Start start{frames.front()};
    for (Eigen::Index i = 0; i < count; ++i) {
      const std::size_t frame = frames[static_cast<std::size_t>(i)];
      tracked.col(i) = seen.frames[frame].camera_from_map.OriginInSource();
      truth.col(i) = simulation.world_from_camera(static_cast<int>(frame)).translation;
      if (i > 0) start.path_m += (truth.col(i) - truth.col(i - 1)).norm();
    }
    const Eigen::Matrix4d truth_from_map = Eigen::umeyama(tracked, truth);
    const Eigen::Matrix3Xd aligned =
        (truth_from_map.topLeftCorner<3, 3>() * tracked).colwise() + truth_from_map.topRightCorner<3, 1>();
    start.error_m = std::sqrt((aligned - truth).squaredNorm() / static_cast<double>(count));
    starts.push_back(start);
  }
  std::sort(starts.begin(), starts.end(), [](const Start& a, const Start& b) { return a.frame < b.frame; });
  return starts;
}

}  // namespace docent::app::faulty_camera

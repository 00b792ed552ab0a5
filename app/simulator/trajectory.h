// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/geometry/rigid3.h"

namespace docent::app {

// Trajectory of a hand-held camera: waypoints joined by monotone cubic curves (Fritsch and Carlson 1980),
// which do not overshoot, so that a camera between equal waypoints does not move; plus the smooth sway of a
// hand (a few millimetres and tenths of a degree, from a seed). World frame: x right, y down, z forward.
// Written by one thread, then read by any thread.
class Trajectory {
 public:
  explicit Trajectory(std::uint64_t seed);

  // The trajectory from its present end on has this label, until the next call.
  void BeginSegment(const std::string& label);
  // Adds a waypoint at `position`, looking at `target`, `seconds` after the last waypoint (0 for the first
  // one). sway: factor of the hand sway; 0: tripod.
  void LookFrom(const Eigen::Vector3d& position, const Eigen::Vector3d& target, double seconds,
                double sway = 1);
  // Adds a waypoint given by angles: yaw to the right from +z, pitch upwards.
  void MoveTo(const Eigen::Vector3d& position, double yaw_rad, double pitch_rad, double seconds,
              double sway = 1);

  double duration_s() const { return waypoints_.empty() ? 0 : waypoints_.back().time_s; }
  // Pose at a time; constant before the beginning and after the end.
  engine::Rigid3 WorldFromCamera(double time_s) const;
  const std::string& LabelAt(double time_s) const;
  // Values of the last waypoint.
  Eigen::Vector3d last_position() const { return waypoints_.back().values.head<3>(); }
  double last_yaw_rad() const { return waypoints_.back().values[3]; }
  double last_pitch_rad() const { return waypoints_.back().values[4]; }

 private:
  using Values = Eigen::Matrix<double, 6, 1>;  // Position, yaw, pitch, sway.
  struct Waypoint {
    double time_s;
    Values values;
  };
  struct Segment {
    double start_s;
    std::string label;
  };
  struct Wave {
    double frequency_hz, phase_rad, amplitude;
  };
  Values Slope(std::size_t waypoint) const;

  std::vector<Waypoint> waypoints_;
  std::vector<Segment> segments_;
  std::array<std::array<Wave, 3>, 6> sway_;  // Metres along x y z, radians about x y z.
};

}  // namespace docent::app

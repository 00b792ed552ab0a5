// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/trajectory.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/random.h"

namespace docent::app {

Trajectory::Trajectory(std::uint64_t seed) {
  Random random(seed);
  for (std::size_t axis = 0; axis < sway_.size(); ++axis) {
    // Up to 6 mm and 0.4 degrees in total; slow waves are larger than fast ones, as with a hand.
    const double amplitude = axis < 3 ? 0.003 : 0.0035;
    for (std::size_t i = 0; i < 3; ++i) {
      sway_[axis][i] = {random.Uniform(0.3, 0.6) * static_cast<double>(1 << i),
                        random.Uniform(0, 2 * std::numbers::pi), amplitude / static_cast<double>(1 << i)};
    }
  }
}

void Trajectory::BeginSegment(const std::string& label) {
  segments_.push_back({duration_s(), label});
}

void Trajectory::LookFrom(const Eigen::Vector3d& position, const Eigen::Vector3d& target, double seconds,
                          double sway) {
  const Eigen::Vector3d gaze = target - position;
  MoveTo(position, std::atan2(gaze.x(), gaze.z()), std::atan2(-gaze.y(), std::hypot(gaze.x(), gaze.z())),
         seconds, sway);
}

void Trajectory::MoveTo(const Eigen::Vector3d& position, double yaw_rad, double pitch_rad, double seconds,
                        double sway) {
  Waypoint waypoint;
  waypoint.time_s = duration_s() + (waypoints_.empty() ? 0 : seconds);
  if (!waypoints_.empty()) {
    // The yaw angle nearest to the previous one avoids a rotation the long way round.
    const double tau = 2 * std::numbers::pi;
    yaw_rad += tau * std::round((last_yaw_rad() - yaw_rad) / tau);
  }
  waypoint.values << position, yaw_rad, pitch_rad, sway;
  waypoints_.push_back(waypoint);
}

// Harmonic mean of the two neighbouring slopes; zero when their signs differ, and at the ends.
Trajectory::Values Trajectory::Slope(std::size_t waypoint) const {
  Values slope = Values::Zero();
  if (waypoint == 0 || waypoint + 1 >= waypoints_.size()) return slope;
  const Waypoint &before = waypoints_[waypoint - 1], &here = waypoints_[waypoint],
                 &after = waypoints_[waypoint + 1];
  const double step_before = here.time_s - before.time_s, step_after = after.time_s - here.time_s;
  const double weight_before = 2 * step_after + step_before, weight_after = step_after + 2 * step_before;
  for (int i = 0; i < slope.size(); ++i) {
    const double slope_before = (here.values[i] - before.values[i]) / step_before;
    const double slope_after = (after.values[i] - here.values[i]) / step_after;
    if (slope_before * slope_after <= 0) continue;
    slope[i] = (weight_before + weight_after) / (weight_before / slope_before + weight_after / slope_after);
  }
  return slope;
}

engine::Rigid3 Trajectory::WorldFromCamera(double time_s) const {
  const double time = std::clamp(time_s, 0.0, duration_s());
  const auto after = std::upper_bound(waypoints_.begin() + 1, waypoints_.end() - 1, time,
                                      [](double t, const Waypoint& waypoint) { return t < waypoint.time_s; });
  const std::size_t next = static_cast<std::size_t>(after - waypoints_.begin());
  const Waypoint &from = waypoints_[next - 1], &to = waypoints_[next];
  const double step = to.time_s - from.time_s, s = (time - from.time_s) / step;
  const double s2 = s * s, s3 = s2 * s;
  const Values values = (2 * s3 - 3 * s2 + 1) * from.values + (s3 - 2 * s2 + s) * step * Slope(next - 1) +
                        (3 * s2 - 2 * s3) * to.values + (s3 - s2) * step * Slope(next);
  Values sway = Values::Zero();
  for (std::size_t axis = 0; axis < sway_.size(); ++axis) {
    for (const Wave& wave : sway_[axis]) {
      sway[static_cast<Eigen::Index>(axis)] +=
          values[5] * wave.amplitude *
          std::sin(2 * std::numbers::pi * wave.frequency_hz * time + wave.phase_rad);
    }
  }
  const engine::Rotation3 rotation(
      Eigen::Quaterniond(Eigen::AngleAxisd(values[3], Eigen::Vector3d::UnitY()) *
                         Eigen::AngleAxisd(values[4], Eigen::Vector3d::UnitX())));
  return {rotation * engine::Rotation3::Exp(sway.tail<3>()), values.head<3>() + sway.head<3>()};
}

const std::string& Trajectory::LabelAt(double time_s) const {
  const auto after = std::upper_bound(segments_.begin() + 1, segments_.end(), time_s,
                                      [](double t, const Segment& segment) { return t < segment.start_s; });
  return std::prev(after)->label;
}

}  // namespace docent::app

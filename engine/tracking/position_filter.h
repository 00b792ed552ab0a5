// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "engine/base/time.h"
#include "engine/geometry/sim3.h"
#include "engine/matching/pose_refinement.h"

namespace docent::engine {

// A Kalman filter of the camera centre with constant velocity: it says where a camera can be that was tracked
// until now. A few distant points that lie in a plane hardly tell a translation from a rotation, and small
// errors of the map then move the camera by a tenth of its distance to the points from one image to the next,
// which no person can do. Its variances are the same along all axes, and relative to the median depth of the
// points, because maps have no scale. Used on the camera's thread.
class PositionFilter {
 public:
  // The next pose does not continue the previous ones.
  void Reset() { state_.reset(); }
  // A pose whose position was estimated from points. sigma: the standard deviation of the position by these
  // points alone. depth: their median. Both in map units. predicted: the prediction is part of the estimate.
  void Add(Timestamp time, const Eigen::Vector3d& center, double sigma, double depth, bool predicted);
  // At this time; empty before the first pose. depth: as in Add.
  std::optional<PredictedPosition> Predict(Timestamp time, double depth) const;
  // To be called when the mapper has moved this part of the map.
  void ApplyCorrection(const Sim3& after_from_before);

 private:
  struct State {
    Timestamp time{};
    Eigen::Vector3d center = Eigen::Vector3d::Zero();    // in the map, map units
    Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // map units per second
    // Variances of a coordinate of the centre and of the velocity, and their covariance; map units, seconds.
    double center_variance = 0, velocity_variance = 0, covariance = 0;
  };
  static State At(const State& state, Timestamp time, double depth);

  std::optional<State> state_;
};

}  // namespace docent::engine

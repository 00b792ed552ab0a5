// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "engine/base/time.h"
#include "engine/geometry/rigid3.h"
#include "engine/map/map_correction.h"

namespace docent::engine {

// Predicts the next pose: constant velocity while frames are tracked, decaying while they are not (ptamm
// §2.1).
class MotionModel {
 public:
  void Reset(Timestamp time, const Rigid3& camera_from_map) {
    time_ = time;
    camera_from_map_ = camera_from_map;
    twist_per_second_.setZero();
  }
  void Update(Timestamp time, const Rigid3& camera_from_map) {
    const double seconds = ToSeconds(time - time_);
    if (seconds > 0) {
      const Eigen::Matrix<double, 6, 1> measured =
          (camera_from_map * camera_from_map_.inverse()).Log() / seconds;
      // Half old, half new: hand-held motion is smooth, single measurements are not.
      twist_per_second_ = 0.4 * twist_per_second_ + 0.6 * measured;
    }
    time_ = time;
    camera_from_map_ = camera_from_map;
  }
  // No pose was found at this time: the camera is taken to slow down where it was.
  void Miss(Timestamp time) {
    camera_from_map_ = Predict(time);
    time_ = time;
    twist_per_second_ *= 0.5;
  }
  Rigid3 Predict(Timestamp time) const {
    // A gap in the video says nothing about how the motion went on.
    const double seconds = std::clamp(ToSeconds(time - time_), 0.0, 0.2);
    return Rigid3::Exp(twist_per_second_ * seconds) * camera_from_map_;
  }
  // Only the sideways and the rotating part replaced by what the images say; see Tracker.
  Rigid3 PredictWithRotation(const Rotation3& now_from_previous) const {
    return Rigid3(now_from_previous, Eigen::Vector3d::Zero()) * camera_from_map_;
  }
  // The map has moved under the camera.
  void Follow(const Sim3& after_from_before) {
    camera_from_map_ = CarriedAlong(camera_from_map_, after_from_before);
    twist_per_second_.head<3>() *= after_from_before.scale;
  }
  const Rigid3& last() const { return camera_from_map_; }

 private:
  Timestamp time_{};
  Rigid3 camera_from_map_;
  Eigen::Matrix<double, 6, 1> twist_per_second_ = Eigen::Matrix<double, 6, 1>::Zero();
};

}  // namespace docent::engine

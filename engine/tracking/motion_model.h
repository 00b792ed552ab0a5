// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>

#include "engine/base/time.h"
#include "engine/geometry/rigid3.h"
#include "engine/map/map_correction.h"

namespace docent::engine {

// Predicts the next pose: constant velocity while frames are tracked, decaying velocity while they are not
// (ptamm §2.1).
class MotionModel {
 public:
  void Reset(Timestamp time, const Rigid3& camera_from_map) {
    time_ = time;
    camera_from_map_ = camera_from_map;
    before_miss_.reset();
    center_time_.reset();
    twist_per_second_.setZero();
  }
  // After Reset: the centre of the pose is that of an earlier time, and the camera rotates at this rate
  // (radians per second, camera frame).
  void SetRotating(Timestamp center_time, const Eigen::Vector3d& rate_per_second) {
    center_time_ = center_time;
    twist_per_second_.tail<3>() = rate_per_second;
  }
  void Update(Timestamp time, const Rigid3& camera_from_map) {
    const double seconds = SecondsUntil(time);
    if (seconds > 0) {
      const Eigen::Matrix<double, 6, 1> measured = MeanTwist(time, camera_from_map);
      const double usual = usual_interval_s_ > 0 ? usual_interval_s_ : seconds;
      usual_interval_s_ = 0.9 * usual + 0.1 * std::min(seconds, 2 * usual);
      // Low-pass filter: hand-held motion is smooth, single measurements are noisy.
      twist_per_second_ = 0.4 * twist_per_second_ + 0.6 * measured;
    }
    time_ = time;
    camera_from_map_ = camera_from_map;
    before_miss_.reset();
    center_time_.reset();
  }
  // To be called when no pose was found: the velocity is halved.
  void Miss(Timestamp time) {
    before_miss_ = camera_from_map_;
    camera_from_map_ = Predict(time);
    time_ = time;
    twist_per_second_ *= 0.5;
  }
  Rigid3 Predict(Timestamp time) const {
    // Beyond 0.2 s the velocity is not extrapolated: a gap in the video tells nothing about the motion within
    // it.
    const double seconds = std::clamp(ToSeconds(time - time_), 0.0, 0.2);
    return Rigid3::Exp(twist_per_second_ * seconds) * camera_from_map_;
  }
  // Rotates the last pose by a given rotation, without translation.
  Rigid3 PredictWithRotation(const Rotation3& now_from_previous) const {
    return Rigid3(now_from_previous, Eigen::Vector3d::Zero()) * camera_from_map_;
  }
  // The same for the frame at `time`, of which a prediction may be the last pose already: of a frame without
  // a pose, or one that was given with Reset.
  Rigid3 PredictWithRotation(Timestamp time, const Rotation3& now_from_previous) const {
    if (time_ < time) return PredictWithRotation(now_from_previous);
    if (!before_miss_) return camera_from_map_;
    return Rigid3(now_from_previous, Eigen::Vector3d::Zero()) * *before_miss_;
  }
  // To be called when the mapper has moved this part of the map.
  void ApplyCorrection(const Sim3& after_from_before) {
    camera_from_map_ = CorrectedPose(camera_from_map_, after_from_before);
    twist_per_second_.head<3>() *= after_from_before.scale;
  }
  // The time since the last pose, to divide a motion by: not less than half of the usual interval, since
  // times are those of arrival where a driver or a file states no better ones, and one of a millisecond would
  // make the motion that belongs to a whole interval thirty times as fast. At most 0 for the past.
  double SecondsUntil(Timestamp time) const {
    const double seconds = ToSeconds(time - time_);
    return seconds > 0 ? std::max(seconds, 0.5 * usual_interval_s_) : seconds;
  }
  // The left twist per second from the last pose to this later one.
  Eigen::Matrix<double, 6, 1> MeanTwist(Timestamp time, const Rigid3& camera_from_map) const {
    const double seconds = SecondsUntil(time);
    Eigen::Matrix<double, 6, 1> twist = (camera_from_map * camera_from_map_.inverse()).Log() / seconds;
    if (center_time_) twist.head<3>() *= seconds / std::max(seconds, ToSeconds(time - *center_time_));
    return twist;
  }
  // Of the last pose: its time, and its left twist (translation, rotation) per second.
  const Eigen::Matrix<double, 6, 1>& twist_per_second() const { return twist_per_second_; }
  Timestamp time() const { return time_; }
  const Rigid3& last() const { return camera_from_map_; }

 private:
  Timestamp time_{};
  double usual_interval_s_ = 0;  // between two poses; 0 if not known yet
  Rigid3 camera_from_map_;
  std::optional<Rigid3> before_miss_;     // the pose before the last frame, if that one has none
  std::optional<Timestamp> center_time_;  // of the last centre, if it is not that of the last pose
  Eigen::Matrix<double, 6, 1> twist_per_second_ = Eigen::Matrix<double, 6, 1>::Zero();
};

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/rotation_center.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/option_check.h"

namespace docent::engine {

std::optional<std::string> RotationCenterOptions::Validate() const {
  return OptionCheck()
      .NotNegative(window, "window of the rotation centre")
      .NotNegative(interval, "interval between poses of the rotation centre")
      .AtLeast(min_poses, 3, "number of poses of the rotation centre")
      .Positive(min_rotation_deg, "rotation about the rotation centre")
      .Positive(position_noise, "position noise")
      .Positive(rotation_noise, "rotation noise")
      .Positive(max_position_sigma, "sigma of the position")
      .Positive(max_distance, "distance of the rotation centre")
      .Positive(max_residual_ratio, "residual ratio of the rotation centre")
      .Positive(max_reliable_residual_ratio, "residual ratio of a reliable rotation centre")
      .Positive(max_reliable_residual, "residual of a reliable rotation centre")
      .fault();
}

void RotationCenter::Add(Timestamp time, const Rigid3& camera_from_map,
                         const Eigen::Matrix<double, 6, 6>& covariance, double depth) {
  const double variance = covariance.topLeftCorner<3, 3>().trace();
  const double max_sigma = options_.max_position_sigma * depth;
  if (!(variance <= max_sigma * max_sigma)) return;
  if (!poses_.empty() && time - poses_.back().time < options_.interval) return;
  const auto old = std::find_if(poses_.begin(), poses_.end(),
                                [&](const Pose& pose) { return time - pose.time <= options_.window; });
  poses_.erase(poses_.begin(), old);
  poses_.push_back({time, camera_from_map.rotation.matrix().transpose(), camera_from_map.OriginInSource()});
}

// Estimates the fixed point: center_i + map_from_camera_i * pivot is the same for all i. The problem is
// linear in the pivot once the means are subtracted. A ridge term keeps the component along the rotation
// axis, which is not observable, at the camera.
PivotEstimate RotationCenter::Estimate(double depth) const {
  const PivotEstimate unknown;
  const auto count = static_cast<double>(poses_.size());
  if (!options_.enabled || static_cast<int>(poses_.size()) < options_.min_poses || !(depth > 0))
    return unknown;
  Eigen::Matrix3d mean_rotation = Eigen::Matrix3d::Zero();
  Eigen::Vector3d mean_center = Eigen::Vector3d::Zero();
  double rotation = 0;
  for (const Pose& pose : poses_) {
    mean_rotation += pose.map_from_camera / count;
    mean_center += pose.center / count;
    const double cosine = pose.map_from_camera.col(2).dot(poses_.back().map_from_camera.col(2));
    rotation = std::max(rotation, std::acos(std::clamp(cosine, -1.0, 1.0)));
  }
  if (rotation < options_.min_rotation_deg * std::numbers::pi / 180) return unknown;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double spread = 0;
  for (const Pose& pose : poses_) {
    const Eigen::Matrix3d a = pose.map_from_camera - mean_rotation;
    const Eigen::Vector3d b = pose.center - mean_center;
    normal += a.transpose() * a;
    right -= a.transpose() * b;
    spread += b.squaredNorm();
  }
  const double noise = options_.position_noise * depth;
  if (spread < count * noise * noise) return {.reliable = true};  // rotation about the camera centre
  normal.diagonal().array() += count * options_.rotation_noise * options_.rotation_noise;
  const Eigen::Vector3d pivot = normal.ldlt().solve(right);
  double squared_residual = 0;
  for (const Pose& pose : poses_) {
    squared_residual +=
        (pose.center - mean_center + (pose.map_from_camera - mean_rotation) * pivot).squaredNorm();
  }
  if (squared_residual > options_.max_residual_ratio * options_.max_residual_ratio * spread ||
      pivot.norm() > options_.max_distance * depth)
    return unknown;
  const double max_residual = options_.max_reliable_residual * depth;
  const bool reliable = squared_residual <= options_.max_reliable_residual_ratio *
                                                options_.max_reliable_residual_ratio * spread &&
                        squared_residual <= count * max_residual * max_residual;
  return {pivot, reliable};
}

Rigid3 RotatedAbout(const Eigen::Vector3d& pivot, const Rigid3& camera_from_map, const Rotation3& rotation) {
  const Eigen::Vector3d pivot_in_map = camera_from_map.inverse() * pivot;
  return Rigid3(rotation, pivot - rotation * pivot_in_map);
}

}  // namespace docent::engine

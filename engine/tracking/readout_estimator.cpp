// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/readout_estimator.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "engine/base/option_check.h"
#include "engine/geometry/readout_prior.h"

namespace docent::engine {

namespace {

using Matrix8 = Eigen::Matrix<double, 8, 8>;
using Vector8 = Eigen::Matrix<double, 8, 1>;

// What one frame says: normal equations of the readout time with the pose eliminated. Residuals are
// normalized.
struct FrameEquations {
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
};

std::optional<FrameEquations> EliminatePose(const Matrix8& normal, const Vector8& gradient) {
  const Eigen::LDLT<Eigen::Matrix<double, 6, 6>> pose(normal.topLeftCorner<6, 6>());
  const Eigen::Matrix<double, 6, 1> pivots = pose.vectorD();
  if (pose.info() != Eigen::Success || !(pivots.minCoeff() > 1e-12 * pivots.maxCoeff())) return std::nullopt;
  const Eigen::Matrix<double, 6, 2> coupling = normal.topRightCorner<6, 2>();
  const Eigen::Matrix<double, 6, 2> solved = pose.solve(coupling);
  FrameEquations result;
  result.information = normal.bottomRightCorner<2, 2>() - coupling.transpose() * solved;
  result.gradient = gradient.tail<2>() - solved.transpose() * gradient.head<6>();
  return result;
}

}  // namespace

std::optional<std::string> ReadoutOptions::Validate() const {
  return OptionCheck()
      .Positive(prior_sigma_s, "sigma of an unknown readout time")
      .AtLeast(correlated_frames, 1, "number of correlated frames")
      .AtLeast(min_sigmas, 0, "significance of a readout time")
      .AtLeast(min_readout_s, 0, "smallest readout time")
      .AtLeast(min_change_s, 0, "change of a readout time")
      .AtLeast(min_rate, 0, "rotation rate")
      .AtLeast(min_inliers, 8, "number of points used to estimate the readout time")
      .AtLeast(max_points, min_inliers, "largest number of points used to estimate the readout time")
      .fault();
}

ReadoutEstimator::ReadoutEstimator(const ReadoutOptions& options) : options_(Checked(options)) {}

void ReadoutEstimator::Add(const CameraModel& camera, const Rigid3& camera_from_map,
                           std::span<const PoseMeasurement> measurements, double sigma, double frame_s) {
  const ReadoutMotion& motion = camera.readout_motion();
  if (!options_.enabled || motion.rotation_rate.norm() < options_.min_rate || !(sigma > 0)) return;
  const auto is_used = [](const PoseMeasurement& m) { return !m.infinite() && m.weight > 0; };
  const auto finite = std::count_if(measurements.begin(), measurements.end(), is_used);
  if (finite < options_.min_inliers) return;
  const auto stride = static_cast<std::size_t>((finite + options_.max_points - 1) / options_.max_points);
  Matrix8 normal = Matrix8::Zero();
  Vector8 gradient = Vector8::Zero();
  std::size_t index = 0;
  for (const PoseMeasurement& measurement : measurements) {
    if (!is_used(measurement) || index++ % stride != 0) continue;
    const Eigen::Vector3d x = camera_from_map * Eigen::Vector3d(measurement.point_in_map.head<3>());
    Eigen::Vector2d pixel;
    Eigen::Matrix<double, 2, 3> by_point;
    if (!camera.Project(x, &pixel, &by_point)) continue;
    by_point *= measurement.inverse_sigma;
    Eigen::Matrix<double, 2, 8> jacobian;
    jacobian.leftCols<3>() = by_point;
    jacobian.middleCols<3>(3) = -by_point * Hat(x);
    const Eigen::Vector2d per_second = by_point * motion.rotation_rate.cross(x);
    jacobian.rightCols<2>() = per_second * camera.ReadoutPosition(pixel).transpose();
    normal.noalias() += measurement.weight * jacobian.transpose() * jacobian;
    gradient.noalias() +=
        measurement.weight * measurement.inverse_sigma * jacobian.transpose() * (measurement.pixel - pixel);
  }
  const auto equations = EliminatePose(normal, gradient);
  if (!equations) return;
  const double scale = static_cast<double>(stride) / (options_.correlated_frames * sigma * sigma);
  information_ += scale * equations->information;
  // The residuals remain after the readout time that the camera has already.
  weighted_ += scale * (equations->gradient + equations->information * motion.readout_s);
  Use(ReadoutAxis(camera), frame_s);
}

Eigen::Matrix2d ReadoutEstimator::Covariance() const {
  const double prior = 1 / (options_.prior_sigma_s * options_.prior_sigma_s);
  return (information_ + prior * Eigen::Matrix2d::Identity()).inverse();
}

Eigen::Vector2d ReadoutEstimator::estimate_s() const {
  return Covariance() * weighted_;
}

Eigen::Vector2d ReadoutEstimator::sigma_s() const {
  return Covariance().diagonal().cwiseSqrt();
}

void ReadoutEstimator::Use(std::optional<Eigen::Index> only, double frame_s) {
  const Eigen::Vector2d estimate = estimate_s(), sigma = sigma_s();
  for (Eigen::Index axis = 0; axis < 2; ++axis) {
    if (axis != only.value_or(axis)) continue;
    const double value = std::clamp(estimate[axis], -frame_s, frame_s);
    const double change = std::max(options_.min_change_s, sigma[axis]);
    const double smallest = std::max(options_.min_readout_s, options_.min_sigmas * sigma[axis]);
    if (used_s_[axis] == 0 && std::abs(value) < smallest) continue;
    if (std::abs(value - used_s_[axis]) < change) continue;
    used_s_[axis] = value;
  }
}

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/pose_refinement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace docent::engine {

namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix26 = Eigen::Matrix<double, 2, 6>;

struct Residual {
  Eigen::Vector2d error;  // normalised by sigma
  Matrix26 jacobian;
  bool valid = false;
};

Residual Evaluate(const CameraModel& camera, const Rigid3& camera_from_map,
                  const PoseMeasurement& measurement) {
  Residual residual;
  const double w = measurement.point_in_map[3];
  const Eigen::Vector3d x = camera_from_map.rotation * Eigen::Vector3d(measurement.point_in_map.head<3>()) +
                            w * camera_from_map.translation;
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> projection;
  if (!camera.Project(x, &pixel, &projection)) return residual;
  residual.error = (measurement.pixel - pixel) * measurement.inverse_sigma;
  projection *= measurement.inverse_sigma;
  residual.jacobian.leftCols<3>() = w * projection;
  residual.jacobian.rightCols<3>() = -projection * Hat(x);
  residual.valid = true;
  return residual;
}

double RobustSigma(std::vector<double>* squared_errors) {
  if (squared_errors->empty()) return 0;
  const auto middle = squared_errors->begin() + static_cast<std::ptrdiff_t>(squared_errors->size() / 2);
  std::nth_element(squared_errors->begin(), middle, squared_errors->end());
  // The median of a Rayleigh variable is 1.1774 sigma: the two-dimensional counterpart of MAD.
  return std::sqrt(*middle) / 1.1774;
}

}  // namespace

PoseRefinement RefinePose(const CameraModel& camera, const Rigid3& start,
                          const PoseRefinementOptions& options, std::vector<PoseMeasurement>* measurements,
                          std::vector<double>* scratch) {
  PoseRefinement result;
  result.camera_from_map = start;
  result.covariance.setZero();
  Matrix6 normal;
  for (int iteration = 0; iteration <= options.iterations; ++iteration) {
    // The last pass only weighs and counts at the final pose.
    const bool last = iteration == options.iterations;
    scratch->clear();
    for (const PoseMeasurement& measurement : *measurements) {
      const double w = measurement.point_in_map[3];
      const Eigen::Vector3d x =
          result.camera_from_map.rotation * Eigen::Vector3d(measurement.point_in_map.head<3>()) +
          w * result.camera_from_map.translation;
      const auto pixel = camera.Project(x);
      if (pixel) {
        scratch->push_back((measurement.pixel - *pixel).squaredNorm() * measurement.inverse_sigma *
                           measurement.inverse_sigma);
      }
    }
    result.sigma = RobustSigma(scratch);
    const double sigma = std::max(result.sigma, options.min_sigma);
    const bool tukey = iteration >= options.iterations / 2;
    const double threshold = sigma * (tukey ? options.tukey_factor : 1.345);

    normal.setZero();
    Vector6 gradient = Vector6::Zero();
    result.inliers = 0;
    for (PoseMeasurement& measurement : *measurements) {
      const Residual residual = Evaluate(camera, result.camera_from_map, measurement);
      if (!residual.valid) {
        measurement.weight = 0;
        continue;
      }
      const double error = residual.error.norm();
      if (tukey) {
        const double ratio = error / threshold;
        measurement.weight = ratio < 1 ? (1 - ratio * ratio) * (1 - ratio * ratio) : 0;
      } else {
        measurement.weight = error <= threshold ? 1 : threshold / error;
      }
      if (measurement.weight > options.min_weight) ++result.inliers;
      normal.noalias() += measurement.weight * residual.jacobian.transpose() * residual.jacobian;
      gradient.noalias() += measurement.weight * residual.jacobian.transpose() * residual.error;
    }
    if (last) break;
    const Eigen::LDLT<Matrix6> factor(normal);
    const Vector6 pivots = factor.vectorD();
    if (factor.info() != Eigen::Success || !(pivots.minCoeff() > 1e-12 * pivots.maxCoeff()) ||
        result.inliers < 3) {
      result.converged = false;
      return result;
    }
    const Vector6 update = factor.solve(gradient);
    result.camera_from_map = Rigid3::Exp(update) * result.camera_from_map;
    // Root mean square shift of the projections that this update made, in sigmas of their levels.
    const double shift = std::sqrt(std::max(0.0, update.dot(normal * update)) / (result.inliers + 1.0));
    // Tukey's weights may swing forever by a little; what no eye can see counts as standing still.
    result.converged = shift < 0.1;
    // Shifts too small to matter end the loop early, but Tukey must have had its say.
    if (shift < 0.01)
      iteration = std::max(iteration, tukey ? options.iterations - 1 : options.iterations / 2 - 1);
  }
  const double sigma = std::max(result.sigma, options.min_sigma);
  result.covariance = sigma * sigma * normal.ldlt().solve(Matrix6::Identity());
  return result;
}

}  // namespace docent::engine

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

// pivot: what the three rotational degrees of freedom turn about, camera frame.
Residual Evaluate(const CameraModel& camera, const Rigid3& camera_from_map, const Eigen::Vector3d& pivot,
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
  // A presumed distance must not move the camera.
  if (measurement.infinite()) {
    residual.jacobian.leftCols<3>().setZero();
  } else {
    residual.jacobian.leftCols<3>() = w * projection;
  }
  residual.jacobian.rightCols<3>() = -projection * Hat(x - w * pivot);
  residual.valid = true;
  return residual;
}

// Fewer rays than this hold no rotation that is worth the name.
constexpr std::ptrdiff_t kFewestRays = 8;

double Square(double x) {
  return x * x;
}

double RobustSigma(std::vector<double>* squared_errors) {
  if (squared_errors->empty()) return 0;
  const auto middle = squared_errors->begin() + static_cast<std::ptrdiff_t>(squared_errors->size() / 2);
  std::nth_element(squared_errors->begin(), middle, squared_errors->end());
  // The median of a Rayleigh variable is 1.1774 sigma: the two-dimensional counterpart of MAD.
  return std::sqrt(*middle) / 1.1774;
}

// One kind of points, finite or infinite, in one iteration.
struct Kind {
  double sigma = 0;      // robust, of the normalised residuals
  double threshold = 0;  // of the loss
};

Kind JudgeKind(const CameraModel& camera, const Rigid3& camera_from_map,
               const std::vector<PoseMeasurement>& measurements, bool infinite,
               const PoseRefinementOptions& options, bool tukey, std::vector<double>* scratch) {
  scratch->clear();
  for (const PoseMeasurement& measurement : measurements) {
    const double w = measurement.point_in_map[3];
    if (measurement.infinite() != infinite) continue;
    const Eigen::Vector3d x = camera_from_map.rotation * Eigen::Vector3d(measurement.point_in_map.head<3>()) +
                              w * camera_from_map.translation;
    const auto pixel = camera.Project(x);
    if (!pixel) continue;
    scratch->push_back((measurement.pixel - *pixel).squaredNorm() * measurement.inverse_sigma *
                       measurement.inverse_sigma);
  }
  Kind kind;
  kind.sigma = RobustSigma(scratch);
  kind.threshold = std::max(kind.sigma, options.min_sigma) * (tukey ? options.tukey_factor : 1.345);
  return kind;
}

double LossWeight(double error, double threshold, bool tukey) {
  if (!tukey) return error <= threshold ? 1 : threshold / error;
  const double ratio = error / threshold;
  return ratio < 1 ? (1 - ratio * ratio) * (1 - ratio * ratio) : 0;
}

// What is taken for known of the motion beside what the measurements say.
struct Held {
  bool turn_only = false;  // the pivot stays exactly where `turn` has it, and only the rotation is estimated
  double sigma = 0;        // else: to within this, in units of the map; 0 for not at all
  double infinite_weight = 1;
};

PoseRefinement Refine(const CameraModel& camera, const Rigid3& start, const PoseRefinementOptions& options,
                      const ExpectedTurn& turn, const Held& held, std::vector<PoseMeasurement>* measurements,
                      std::vector<double>* scratch) {
  const bool turn_only = held.turn_only;
  const Eigen::Vector3d pivot = turn_only ? turn.pivot : Eigen::Vector3d::Zero();
  const Eigen::Vector3d fixed_in_map = turn.camera_from_map.inverse() * turn.pivot;
  PoseRefinement result;
  result.camera_from_map = start;
  result.covariance.setZero();
  Matrix6 normal, measured;
  Kind kinds[2];     // finite, infinite
  double depth = 0;  // summed over finite inliers
  for (int iteration = 0; iteration <= options.iterations; ++iteration) {
    // The last pass only weighs and counts at the final pose.
    const bool last = iteration == options.iterations;
    const bool tukey = iteration >= options.iterations / 2;
    for (const bool infinite : {false, true}) {
      kinds[infinite] =
          JudgeKind(camera, result.camera_from_map, *measurements, infinite, options, tukey, scratch);
    }
    normal.setZero();
    Vector6 gradient = Vector6::Zero();
    result.inliers = result.finite_inliers = 0;
    depth = 0;
    for (PoseMeasurement& measurement : *measurements) {
      const Residual residual = Evaluate(camera, result.camera_from_map, pivot, measurement);
      const bool infinite = measurement.infinite();
      measurement.weight = 0;
      if (!residual.valid) continue;
      measurement.weight = LossWeight(residual.error.norm(), kinds[infinite].threshold, tukey);
      if (measurement.weight > options.min_weight) {
        ++result.inliers;
        result.finite_inliers += !infinite;
        if (!infinite) depth += (result.camera_from_map * measurement.point_in_map).z();
      }
      const double weight = measurement.weight * (infinite ? held.infinite_weight : 1.0);
      normal.noalias() += weight * residual.jacobian.transpose() * residual.jacobian;
      gradient.noalias() += weight * residual.jacobian.transpose() * residual.error;
    }
    measured = normal;
    if (held.sigma > 0) {
      const double information = Square(std::max(kinds[0].sigma, options.min_sigma) / held.sigma);
      const Eigen::Vector3d now = result.camera_from_map * fixed_in_map;
      Eigen::Matrix<double, 3, 6> jacobian;
      jacobian << Eigen::Matrix3d::Identity(), -Hat(now);
      normal.noalias() += information * jacobian.transpose() * jacobian;
      gradient.noalias() += information * jacobian.transpose() * (turn.pivot - now);
    } else if (turn_only) {
      // What little finite points are left must not drag the centre away.
      normal.leftCols<3>().setZero();
      normal.topRows<3>().setZero();
      normal.topLeftCorner<3, 3>().diagonal().setConstant(normal.diagonal().maxCoeff());
      gradient.head<3>().setZero();
    }
    const int enough = held.infinite_weight < 1 ? 1 : options.min_finite;
    result.sigma = kinds[result.finite_inliers >= enough ? 0 : 1].sigma;
    if (last) break;
    const Eigen::LDLT<Matrix6> factor(normal);
    const Vector6 pivots = factor.vectorD();
    if (factor.info() != Eigen::Success || !(pivots.minCoeff() > 1e-12 * pivots.maxCoeff()) ||
        result.inliers < 3) {
      result.converged = false;
      return result;
    }
    const Vector6 update = factor.solve(gradient);
    if (turn_only) {
      const Rigid3 about_pivot(result.camera_from_map.rotation, result.camera_from_map.translation - pivot);
      const Rigid3 turned = Rigid3::Exp(update) * about_pivot;
      result.camera_from_map = Rigid3(turned.rotation, turned.translation + pivot);
    } else {
      result.camera_from_map = Rigid3::Exp(update) * result.camera_from_map;
    }
    // Root mean square shift of the projections that this update made, in sigmas of their levels.
    const int infinite_inliers = result.inliers - result.finite_inliers;
    const double counted = result.finite_inliers + held.infinite_weight * infinite_inliers;
    const double shift = std::sqrt(std::max(0.0, update.dot(normal * update)) / (counted + 1.0));
    // Tukey's weights may swing forever by a little; what no eye can see counts as standing still.
    result.converged = shift < 0.1;
    // Shifts too small to matter end the loop early, but Tukey must have had its say.
    if (shift < 0.01)
      iteration = std::max(iteration, tukey ? options.iterations - 1 : options.iterations / 2 - 1);
  }
  const double sigma = std::max(result.sigma, options.min_sigma);
  result.covariance = sigma * sigma * measured.ldlt().solve(Matrix6::Identity());
  result.mean_depth = result.finite_inliers > 0 ? depth / result.finite_inliers : 0;
  if (turn_only) {
    result.covariance = sigma * sigma * normal.ldlt().solve(Matrix6::Identity());
    result.covariance.leftCols<3>().setZero();
    result.covariance.topRows<3>().setZero();
  }
  return result;
}

// Whether the finite points hold the camera in its place: to within largest, of the depth.
bool IsPlaced(const PoseRefinement& result, double largest) {
  const double variance = result.covariance.topLeftCorner<3, 3>().trace();
  return variance >= 0 && variance <= Square(largest * result.mean_depth);
}

}  // namespace

PoseRefinement RefinePose(const CameraModel& camera, const Rigid3& start,
                          const PoseRefinementOptions& options, std::vector<PoseMeasurement>* measurements,
                          std::vector<double>* scratch, const ExpectedTurn& turn) {
  const auto finite = std::count_if(measurements->begin(), measurements->end(),
                                    [](const PoseMeasurement& m) { return !m.infinite(); });
  const auto infinite = static_cast<std::ptrdiff_t>(measurements->size()) - finite;
  const bool may_turn = infinite >= kFewestRays || (turn.sure && infinite + finite >= kFewestRays);
  Held held;
  if (finite >= options.min_finite || !may_turn) {
    held.infinite_weight = options.infinite_weight;
    PoseRefinement result = Refine(camera, start, options, turn, held, measurements, scratch);
    const Rigid3 by_points_alone = result.camera_from_map;
    const bool enough = result.finite_inliers >= options.min_finite;
    const bool placed = enough && IsPlaced(result, options.max_position_sigma);
    if (turn.sure && enough && !IsPlaced(result, options.max_position_sigma / 2)) {
      held.sigma = options.sure_turn_sigma * result.mean_depth;
      result = Refine(camera, start, options, turn, held, measurements, scratch);
    }
    if (!may_turn || placed || held.sigma > 0) {
      result.by_points_alone = by_points_alone;
      const bool infinite_too = result.inliers > result.finite_inliers;
      result.observed = infinite_too ? ObservedMotion::kHybrid : ObservedMotion::kSixDof;
      if (may_turn && !placed) result.observed = ObservedMotion::kPanorama;
      return result;
    }
    if (enough) held.sigma = options.max_position_sigma * result.mean_depth;
    held.infinite_weight = 1;
  }
  held.turn_only = held.sigma == 0;
  PoseRefinement result = Refine(camera, start, options, turn, held, measurements, scratch);
  result.observed = ObservedMotion::kPanorama;
  return result;
}

}  // namespace docent::engine

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

using Seen = PoseRefinementMemory::Seen;

// rotation, translation: of camera_from_map; a matrix turns many points in half a quaternion's time.
Seen See(const CameraModel& camera, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation,
         const PoseMeasurement& measurement) {
  Seen seen;
  seen.point_in_camera =
      rotation * measurement.point_in_map.head<3>() + measurement.point_in_map[3] * translation;
  Eigen::Vector2d pixel;
  seen.valid = camera.Project(seen.point_in_camera, &pixel, &seen.jacobian);
  if (!seen.valid) return seen;
  seen.error = (measurement.pixel - pixel) * measurement.inverse_sigma;
  seen.jacobian *= measurement.inverse_sigma;
  return seen;
}

// d normalised pixel / d twist; pivot: what the three rotational degrees of freedom turn about, camera frame.
Matrix26 PoseJacobian(const Seen& seen, const PoseMeasurement& measurement, const Eigen::Vector3d& pivot) {
  const double w = measurement.point_in_map[3];
  Matrix26 jacobian;
  // A presumed distance must not move the camera.
  if (measurement.infinite()) {
    jacobian.leftCols<3>().setZero();
  } else {
    jacobian.leftCols<3>() = w * seen.jacobian;
  }
  jacobian.rightCols<3>() = -seen.jacobian * Hat(seen.point_in_camera - w * pivot);
  return jacobian;
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

Kind JudgeKind(const std::vector<PoseMeasurement>& measurements, bool infinite,
               const PoseRefinementOptions& options, bool tukey, PoseRefinementMemory* memory) {
  memory->squared_errors.clear();
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    const Seen& seen = memory->seen[i];
    if (seen.valid && measurements[i].infinite() == infinite)
      memory->squared_errors.push_back(seen.error.squaredNorm());
  }
  Kind kind;
  kind.sigma = RobustSigma(&memory->squared_errors);
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
                      const RotationPrior& turn, const Held& held, std::vector<PoseMeasurement>* measurements,
                      PoseRefinementMemory* memory) {
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
    const Eigen::Matrix3d rotation = result.camera_from_map.rotation.matrix();
    memory->seen.clear();
    for (const PoseMeasurement& measurement : *measurements)
      memory->seen.push_back(See(camera, rotation, result.camera_from_map.translation, measurement));
    for (const bool infinite : {false, true})
      kinds[infinite] = JudgeKind(*measurements, infinite, options, tukey, memory);
    normal.setZero();
    Vector6 gradient = Vector6::Zero();
    result.inliers = result.finite_inliers = 0;
    depth = 0;
    for (std::size_t i = 0; i < measurements->size(); ++i) {
      PoseMeasurement& measurement = (*measurements)[i];
      const Seen& seen = memory->seen[i];
      const bool infinite = measurement.infinite();
      measurement.weight = 0;
      if (!seen.valid) continue;
      measurement.weight = LossWeight(seen.error.norm(), kinds[infinite].threshold, tukey);
      if (measurement.weight > options.min_weight) {
        ++result.inliers;
        result.finite_inliers += !infinite;
        if (!infinite) depth += seen.point_in_camera.z();
      }
      const double weight = measurement.weight * (infinite ? held.infinite_weight : 1.0);
      const Matrix26 jacobian = PoseJacobian(seen, measurement, pivot);
      normal.noalias() += weight * jacobian.transpose() * jacobian;
      gradient.noalias() += weight * jacobian.transpose() * seen.error;
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
                          PoseRefinementMemory* memory, const RotationPrior& turn) {
  const auto finite = std::count_if(measurements->begin(), measurements->end(),
                                    [](const PoseMeasurement& m) { return !m.infinite(); });
  const auto infinite = static_cast<std::ptrdiff_t>(measurements->size()) - finite;
  const bool may_turn = infinite >= kFewestRays || (turn.sure && infinite + finite >= kFewestRays);
  Held held;
  if (finite >= options.min_finite || !may_turn) {
    held.infinite_weight = options.infinite_weight;
    PoseRefinement result = Refine(camera, start, options, turn, held, measurements, memory);
    const Rigid3 camera_from_map_without_prior = result.camera_from_map;
    const bool enough = result.finite_inliers >= options.min_finite;
    const bool placed = enough && IsPlaced(result, options.max_position_sigma);
    if (turn.sure && enough && !IsPlaced(result, options.max_position_sigma / 2)) {
      held.sigma = options.prior_translation_sigma * result.mean_depth;
      result = Refine(camera, start, options, turn, held, measurements, memory);
    }
    if (!may_turn || placed || held.sigma > 0) {
      result.camera_from_map_without_prior = camera_from_map_without_prior;
      const bool infinite_too = result.inliers > result.finite_inliers;
      result.observed = infinite_too ? ObservedMotion::kHybrid : ObservedMotion::kSixDof;
      if (may_turn && !placed) result.observed = ObservedMotion::kPanorama;
      return result;
    }
    if (enough) held.sigma = options.max_position_sigma * result.mean_depth;
    held.infinite_weight = 1;
  }
  held.turn_only = held.sigma == 0;
  PoseRefinement result = Refine(camera, start, options, turn, held, measurements, memory);
  result.observed = ObservedMotion::kPanorama;
  return result;
}

}  // namespace docent::engine

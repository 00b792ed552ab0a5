// SPDX-License-Identifier: Apache-2.0
#include "engine/matching/pose_refinement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "engine/base/multiply_add.h"
#include "engine/base/option_check.h"
#include "engine/geometry/projection_batch.h"
#include "engine/vision/lanes.h"

namespace docent::engine {

namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector6 = Eigen::Matrix<double, 6, 1>;

using Projection = PoseRefinementMemory::Projection;

// Projects as many measurements as fit into a batch. rotation, translation: of camera_from_map; multiplying
// by a matrix takes half the time of a quaternion.
void ProjectMeasurements(const CameraModel& camera, const Eigen::Matrix3d& rotation,
                         const Eigen::Vector3d& translation, std::span<const PoseMeasurement> measurements,
                         std::span<Projection> projections) {
  ProjectionBatch batch;
  for (std::size_t i = 0; i < ProjectionBatch::kSize; ++i) {
    const PoseMeasurement& measurement = measurements[std::min(i, measurements.size() - 1)];
    const Eigen::Vector3d point =
        rotation * measurement.point_in_map.head<3>() + measurement.point_in_map[3] * translation;
    batch.measured_x[i] = measurement.pixel.x();
    batch.measured_y[i] = measurement.pixel.y();
    batch.x[i] = point.x();
    batch.y[i] = point.y();
    batch.z[i] = point.z();
  }
  camera.ProjectAtExposureOf(&batch);
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    const double scale = measurements[i].inverse_sigma;
    Projection& projection = projections[i];
    projection.point_in_camera = {batch.x[i], batch.y[i], batch.z[i]};
    projection.valid = batch.valid[i] != 0;
    projection.error = {(batch.measured_x[i] - batch.pixel_x[i]) * scale,
                        (batch.measured_y[i] - batch.pixel_y[i]) * scale};
    projection.jacobian << batch.xx[i] * scale, batch.xy[i] * scale, batch.xz[i] * scale, batch.yx[i] * scale,
        batch.yy[i] * scale, batch.yz[i] * scale;
  }
}

// Sums the normal equations of a pose. Columns of eight rows, of which the last two stay zero, fill vector
// registers.
class NormalEquations {
 public:
  // Adds a measurement. arm: from the centre of the three rotational degrees of freedom to the point, camera
  // frame. translation: weight of the translational columns of the Jacobian.
  void Add(const Projection& projection, const Eigen::Vector3d& arm, double translation, double weight) {
    std::array<Row, 2> rows;  // of x and y
    std::array<Column, 2> weighted;
    for (int i = 0; i < 2; ++i) {
      rows[i] = RowOf(projection, i, arm, translation);
      const FourDoubles scale = AllDoubles(weight);
      weighted[i] = {FourDoubles(rows[i][0], rows[i][1], rows[i][2], rows[i][3]) * scale,
                     FourDoubles(rows[i][4], rows[i][5], 0, 0) * scale};
    }
    for (std::size_t k = 0; k < columns_.size(); ++k) {
      const FourDoubles x = AllDoubles(rows[0][k]), y = AllDoubles(rows[1][k]);
      columns_[k].top += MultiplyAdd(weighted[1].top, y, weighted[0].top * x);
      columns_[k].bottom += MultiplyAdd(weighted[1].bottom, y, weighted[0].bottom * x);
    }
  }

  void Get(Matrix6* normal, Vector6* gradient) const {
    Eigen::Matrix<double, 8, 7> all;
    for (std::size_t k = 0; k < columns_.size(); ++k) {
      double* column = all.col(static_cast<Eigen::Index>(k)).data();
      Store(columns_[k].top, column);
      Store(columns_[k].bottom, column + 4);
    }
    *normal = all.topLeftCorner<6, 6>();
    *gradient = all.topRightCorner<6, 1>();
  }

 private:
  using Row = std::array<double, 7>;  // d normalized pixel / d twist, and the error
  struct Column {
    FourDoubles top = AllDoubles(0), bottom = AllDoubles(0);
  };

  static Row RowOf(const Projection& projection, int axis, const Eigen::Vector3d& arm, double translation) {
    const double x = projection.jacobian(axis, 0), y = projection.jacobian(axis, 1),
                 z = projection.jacobian(axis, 2);
    return {translation * x,
            translation * y,
            translation * z,
            MultiplyAdd(z, arm.y(), -(y * arm.z())),
            MultiplyAdd(-z, arm.x(), x * arm.z()),
            MultiplyAdd(y, arm.x(), -(x * arm.y())),
            projection.error[axis]};
  }

  std::array<Column, 7> columns_;  // six of the matrix, and the gradient
};

// With fewer rays the rotation is not reliable.
constexpr std::ptrdiff_t kMinRays = 8;

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

// Scale of the residuals of one kind of points, finite or infinite, in one iteration.
struct RobustScale {
  double sigma = 0;      // robust, of the normalized residuals
  double threshold = 0;  // threshold of the loss
};

RobustScale EstimateScale(const std::vector<PoseMeasurement>& measurements, bool infinite,
                          const PoseRefinementOptions& options, bool tukey, PoseRefinementMemory* memory) {
  memory->squared_errors.clear();
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    const Projection& projection = memory->projections[i];
    if (projection.valid && measurements[i].infinite() == infinite)
      memory->squared_errors.push_back(projection.error.squaredNorm());
  }
  RobustScale scale;
  scale.sigma = RobustSigma(&memory->squared_errors);
  scale.threshold = std::max(scale.sigma, options.min_sigma) * (tukey ? options.tukey_factor : 1.345);
  return scale;
}

double LossWeight(double error, double threshold, bool tukey) {
  if (!tukey) return error <= threshold ? 1 : threshold / error;
  const double ratio = error / threshold;
  return ratio < 1 ? (1 - ratio * ratio) * (1 - ratio * ratio) : 0;
}

// Prior constraints on the motion in addition to the measurements.
struct MotionConstraint {
  bool rotation_only = false;  // the pivot is fixed as in the motion prior; only the rotation is estimated
  double sigma = 0;  // otherwise: standard deviation of the pivot's position, map units; 0 for no constraint
  double infinite_weight = 1;
};

// One robust Gauss-Newton refinement of a pose. Used on the stack of one RefinePose call.
class PoseDescent {
 public:
  PoseDescent(const CameraModel& camera, const CameraAtPose& camera_at_pose,
              const PoseRefinementOptions& options, const MotionPrior& prior,
              const MotionConstraint& constraint, std::vector<PoseMeasurement>* measurements,
              PoseRefinementMemory* memory)
      : camera_(&camera),
        camera_at_pose_(camera_at_pose),
        options_(options),
        prior_(prior),
        constraint_(constraint),
        pivot_(constraint.rotation_only ? prior.pivot : Eigen::Vector3d::Zero()),
        pivot_in_map_(prior.camera_from_map.inverse() * prior.pivot),
        measurements_(*measurements),
        memory_(*memory) {}

  PoseRefinement From(const Rigid3& start);

 private:
  // Projects the measurements at the current pose, and estimates the scales of their residuals.
  void Project(bool tukey);
  // Sums the weighted normal equations of the measurements, and counts inliers.
  void Accumulate(bool tukey);
  void AddConstraint();
  // Returns the root mean square shift of the projections by the update, in sigmas of their levels; empty if
  // the equations do not determine an update.
  std::optional<double> Update();
  void EstimateCovariance();

  const CameraModel* camera_;
  const CameraAtPose& camera_at_pose_;
  std::shared_ptr<const CameraModel> camera_of_pose_;  // what it returned
  const PoseRefinementOptions& options_;
  const MotionPrior& prior_;
  const MotionConstraint& constraint_;
  const Eigen::Vector3d pivot_;  // of the rotation, camera frame
  const Eigen::Vector3d pivot_in_map_;
  std::vector<PoseMeasurement>& measurements_;
  PoseRefinementMemory& memory_;
  PoseRefinement result_;
  Matrix6 normal_ = Matrix6::Zero(), measured_ = Matrix6::Zero();  // with the constraint, and without
  Vector6 gradient_ = Vector6::Zero();
  RobustScale scales_[2];  // finite, infinite
  double depth_ = 0;       // summed over finite inliers
};

PoseRefinement PoseDescent::From(const Rigid3& start) {
  result_ = PoseRefinement();
  result_.camera_from_map = start;
  const int min_finite = constraint_.infinite_weight < 1 ? 1 : options_.min_finite;
  for (int iteration = 0; iteration <= options_.iterations; ++iteration) {
    // The last pass only computes weights and counts at the final pose.
    const bool last = iteration == options_.iterations;
    const bool tukey = iteration >= options_.iterations / 2;
    if (tukey && camera_at_pose_ && !camera_of_pose_) {
      camera_of_pose_ = camera_at_pose_(result_.camera_from_map);
      camera_ = camera_of_pose_.get();
    }
    Project(tukey);
    Accumulate(tukey);
    measured_ = normal_;
    AddConstraint();
    result_.sigma = scales_[result_.finite_inliers >= min_finite ? 0 : 1].sigma;
    if (last) break;
    const std::optional<double> shift = Update();
    // Tukey's weights may oscillate slightly without end; an invisible shift counts as converged.
    result_.converged = shift && *shift < 0.1;
    if (!shift) return result_;
    // Negligible shifts end the loop early, but not before iterations with Tukey weights.
    if (*shift < 0.01)
      iteration = std::max(iteration, tukey ? options_.iterations - 1 : options_.iterations / 2 - 1);
  }
  EstimateCovariance();
  result_.mean_depth = result_.finite_inliers > 0 ? depth_ / result_.finite_inliers : 0;
  return result_;
}

void PoseDescent::Project(bool tukey) {
  const Eigen::Matrix3d rotation = result_.camera_from_map.rotation.matrix();
  const std::span<const PoseMeasurement> measurements(measurements_);
  memory_.projections.resize(measurements.size());
  for (std::size_t first = 0; first < measurements.size(); first += ProjectionBatch::kSize) {
    const std::size_t count = std::min(ProjectionBatch::kSize, measurements.size() - first);
    ProjectMeasurements(*camera_, rotation, result_.camera_from_map.translation,
                        measurements.subspan(first, count),
                        std::span(memory_.projections).subspan(first, count));
  }
  for (const bool infinite : {false, true})
    scales_[infinite] = EstimateScale(measurements_, infinite, options_, tukey, &memory_);
}

void PoseDescent::Accumulate(bool tukey) {
  NormalEquations equations;
  result_.inliers = result_.finite_inliers = 0;
  depth_ = 0;
  for (std::size_t i = 0; i < measurements_.size(); ++i) {
    PoseMeasurement& measurement = measurements_[i];
    const Projection& projection = memory_.projections[i];
    const bool infinite = measurement.infinite();
    measurement.weight = 0;
    if (!projection.valid) continue;
    measurement.weight = LossWeight(projection.error.norm(), scales_[infinite].threshold, tukey);
    if (measurement.weight > options_.min_weight) {
      ++result_.inliers;
      result_.finite_inliers += !infinite;
      if (!infinite) depth_ += projection.point_in_camera.z();
    }
    const double w = measurement.point_in_map[3];
    // The assumed distance of an infinite point must not constrain the translation.
    equations.Add(projection, projection.point_in_camera - w * pivot_, infinite ? 0 : w,
                  measurement.weight * (infinite ? constraint_.infinite_weight : 1.0));
  }
  equations.Get(&normal_, &gradient_);
}

void PoseDescent::AddConstraint() {
  if (constraint_.sigma > 0) {
    const double information = Square(std::max(scales_[0].sigma, options_.min_sigma) / constraint_.sigma);
    const Eigen::Vector3d now = result_.camera_from_map * pivot_in_map_;
    Eigen::Matrix<double, 3, 6> jacobian;
    jacobian << Eigen::Matrix3d::Identity(), -Hat(now);
    normal_.noalias() += information * jacobian.transpose() * jacobian;
    gradient_.noalias() += information * jacobian.transpose() * (prior_.pivot - now);
  } else if (constraint_.rotation_only) {
    // The few finite points left must not move the camera centre.
    normal_.leftCols<3>().setZero();
    normal_.topRows<3>().setZero();
    normal_.topLeftCorner<3, 3>().diagonal().setConstant(normal_.diagonal().maxCoeff());
    gradient_.head<3>().setZero();
  }
}

std::optional<double> PoseDescent::Update() {
  const Eigen::LDLT<Matrix6> factor(normal_);
  const Vector6 pivots = factor.vectorD();
  if (factor.info() != Eigen::Success || !(pivots.minCoeff() > 1e-12 * pivots.maxCoeff()) ||
      result_.inliers < 3)
    return std::nullopt;
  const Vector6 update = factor.solve(gradient_);
  Rigid3& pose = result_.camera_from_map;
  if (constraint_.rotation_only) {
    const Rigid3 rotated = Rigid3::Exp(update) * Rigid3(pose.rotation, pose.translation - pivot_);
    pose = Rigid3(rotated.rotation, rotated.translation + pivot_);
  } else {
    pose = Rigid3::Exp(update) * pose;
  }
  const int infinite_inliers = result_.inliers - result_.finite_inliers;
  const double counted = result_.finite_inliers + constraint_.infinite_weight * infinite_inliers;
  return std::sqrt(std::max(0.0, update.dot(normal_ * update)) / (counted + 1.0));
}

void PoseDescent::EstimateCovariance() {
  const double sigma = std::max(result_.sigma, options_.min_sigma);
  if (!constraint_.rotation_only) {
    result_.covariance = sigma * sigma * measured_.ldlt().solve(Matrix6::Identity());
    return;
  }
  result_.covariance = sigma * sigma * normal_.ldlt().solve(Matrix6::Identity());
  result_.covariance.leftCols<3>().setZero();
  result_.covariance.topRows<3>().setZero();
}

// Whether the finite points determine the camera position to within this ratio of the mean depth.
bool IsPositionObservable(const PoseRefinement& result, double max_sigma) {
  const double variance = result.covariance.topLeftCorner<3, 3>().trace();
  return variance >= 0 && variance <= Square(max_sigma * result.mean_depth);
}

}  // namespace

std::optional<std::string> PoseRefinementOptions::Validate() const {
  return OptionCheck()
      .AtLeast(iterations, 1, "number of iterations of the pose refinement")
      .Positive(tukey_factor, "factor of the robust threshold")
      .Positive(min_sigma, "smallest sigma of the residuals of a pose")
      .Ratio(min_weight, "weight of an inlier")
      .Ratio(infinite_weight, "weight of an infinite point")
      .AtLeast(min_finite, 0, "number of finite points that determine the translation")
      .AtLeast(common_error_factor, 1, "factor of the common errors of points")
      .Positive(max_position_sigma, "position sigma of a determined translation")
      .Positive(prior_translation_sigma, "translation sigma of a rotation")
      .fault();
}

PoseRefinement RefinePose(const CameraModel& camera, const Rigid3& start,
                          const PoseRefinementOptions& options, std::vector<PoseMeasurement>* measurements,
                          PoseRefinementMemory* memory, const MotionPrior& prior,
                          const CameraAtPose& camera_at_pose) {
  const auto descend = [&](const MotionPrior& motion, const MotionConstraint& constraint) {
    return PoseDescent(camera, camera_at_pose, options, motion, constraint, measurements, memory).From(start);
  };
  const auto finite = std::count_if(measurements->begin(), measurements->end(),
                                    [](const PoseMeasurement& m) { return !m.infinite(); });
  const auto infinite = static_cast<std::ptrdiff_t>(measurements->size()) - finite;
  const bool rotation_observable = infinite >= kMinRays || (prior.reliable && infinite + finite >= kMinRays);
  MotionConstraint constraint;
  if (finite >= options.min_finite || !rotation_observable) {
    constraint.infinite_weight = options.infinite_weight;
    PoseRefinement result = descend(prior, constraint);
    Rigid3 camera_from_map_without_prior = result.camera_from_map;
    const bool enough_finite = result.finite_inliers >= options.min_finite;
    const bool position_observable =
        enough_finite && IsPositionObservable(result, options.max_position_sigma);
    const bool needs_prior = !enough_finite || !IsPositionObservable(result, options.max_position_sigma / 2);
    if (prior.reliable && enough_finite && needs_prior) {
      constraint.sigma = options.prior_translation_sigma * result.mean_depth;
      result = descend(prior, constraint);
    } else if (prior.center && needs_prior && (!rotation_observable || position_observable)) {
      constraint.sigma = prior.center->sigma / options.common_error_factor;
      const MotionPrior center{Eigen::Vector3d::Zero(),
                               Rigid3(start.rotation, -(start.rotation * prior.center->center))};
      result = descend(center, constraint);
      result.used_center = true;
      camera_from_map_without_prior = result.camera_from_map;
    }
    if (!rotation_observable || position_observable || constraint.sigma > 0) {
      result.camera_from_map_without_prior = camera_from_map_without_prior;
      const bool infinite_too = result.inliers > result.finite_inliers;
      result.observed = infinite_too ? ObservedMotion::kHybrid : ObservedMotion::kSixDof;
      if (rotation_observable && !position_observable) result.observed = ObservedMotion::kPanorama;
      return result;
    }
    if (enough_finite) constraint.sigma = options.max_position_sigma * result.mean_depth;
    constraint.infinite_weight = 1;
  }
  constraint.rotation_only = constraint.sigma == 0;
  PoseRefinement result = descend(prior, constraint);
  result.observed = ObservedMotion::kPanorama;
  return result;
}

}  // namespace docent::engine

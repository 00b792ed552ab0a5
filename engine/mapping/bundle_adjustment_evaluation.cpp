// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle_adjustment_evaluation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace docent::engine {
namespace {

// Measurements between two looks at the interrupt: about 0.02 ms.
constexpr int kInterruptStride = 256;
// Median of the norm of a two-dimensional normal variable, in standard deviations: sqrt(2 ln 2).
constexpr double kRayleighMedian = 1.1774100225154747;
// A pivot smaller than this part of the largest diagonal entry carries no information.
constexpr double kPivotRatio = 1e-13;
// Residual, in thresholds, that Huber's loss charges for a measurement that does not project.
constexpr double kUnprojectableThresholds = 10;

}  // namespace

RobustValue EvaluateLoss(RobustLoss loss, double threshold, double squared_residual) {
  const double squared_threshold = threshold * threshold;
  if (loss == RobustLoss::kTukey) {
    if (squared_residual >= squared_threshold) {
      return {squared_threshold / 3, 0};
    }
    const double u = 1 - squared_residual / squared_threshold;
    return {squared_threshold / 3 * (1 - u * u * u), u * u};
  }
  if (squared_residual <= squared_threshold) {
    return {squared_residual, 1};
  }
  const double residual = std::sqrt(squared_residual);
  return {2 * threshold * residual - squared_threshold, threshold / residual};
}

double CostOfUnprojectable(RobustLoss loss, double threshold) {
  const double residual = kUnprojectableThresholds * threshold;
  return EvaluateLoss(loss, threshold, residual * residual).cost;
}

double RobustCost(RobustLoss loss, double threshold, const std::vector<double>& squared_norms) {
  double sum = 0;
  for (const double squared_norm : squared_norms) {
    sum += std::isfinite(squared_norm) ? EvaluateLoss(loss, threshold, squared_norm).cost
                                       : CostOfUnprojectable(loss, threshold);
  }
  return 0.5 * sum;
}

double EstimateSigma(const std::vector<double>& squared_norms) {
  std::vector<double> finite;
  finite.reserve(squared_norms.size());
  std::copy_if(squared_norms.begin(), squared_norms.end(), std::back_inserter(finite),
               [](double norm) { return std::isfinite(norm); });
  if (finite.empty()) {
    return 0;
  }
  const auto middle = finite.begin() + static_cast<std::ptrdiff_t>(finite.size() / 2);
  std::nth_element(finite.begin(), middle, finite.end());
  return std::sqrt(*middle) / kRayleighMedian;
}

BundleEvaluation::BundleEvaluation(const BundleProblem& problem, RobustLoss loss,
                                   const std::atomic<bool>* interrupt)
    : loss_(loss), interrupt_(interrupt) {
  poses_.resize(kPoseSize * problem.cameras.size());
  points_.resize(3 * problem.points.size());
  cameras_.resize(problem.cameras.size());
  for (std::size_t i = 0; i < problem.cameras.size(); ++i) {
    PackPose(problem.cameras[i].camera_from_map, pose_state(static_cast<int>(i)));
    cameras_[i].model = problem.cameras[i].model.get();
    const Rigid3& camera_from_map = problem.cameras[i].camera_from_map;
    free_cameras_.push_back(!problem.cameras[i].fixed && camera_from_map.translation.allFinite() &&
                            camera_from_map.rotation.quaternion().coeffs().allFinite());
  }
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    std::copy_n(problem.points[i].position.data(), 3, point_state(static_cast<int>(i)));
    free_points_.push_back(!problem.points[i].fixed && problem.points[i].position.allFinite());
  }
  PackMeasurements(problem);
  squared_norms_.resize(measurements_.size());
  for (std::size_t i = condensed_begin_; i < pairs_begin_; ++i) {
    if (condensed_.empty() || condensed_.back().point != measurements_[i].point) {
      condensed_.emplace_back().point = measurements_[i].point;
      condensed_ends_.push_back(0);
    }
    condensed_ends_.back() = i + 1;
  }
  pairs_.resize(measurements_.size() - pairs_begin_);
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    pairs_[i].camera = measurements_[pairs_begin_ + i].camera;
    pairs_[i].point = measurements_[pairs_begin_ + i].point;
  }
}

// A counting sort by part and point.
void BundleEvaluation::PackMeasurements(const BundleProblem& problem) {
  const std::size_t point_count = problem.points.size();
  const auto key = [&](const BundleProblem::Measurement& measurement) {
    const std::size_t part = is_camera_free(measurement.camera) ? 2
                             : is_point_free(measurement.point) ? 1
                                                                : 0;
    return part * point_count + static_cast<std::size_t>(measurement.point);
  };
  std::vector<std::size_t> next(3 * point_count + 1, 0);
  for (const BundleProblem::Measurement& measurement : problem.measurements) {
    ++next[key(measurement) + 1];
  }
  std::partial_sum(next.begin(), next.end(), next.begin());
  condensed_begin_ = next[point_count];
  pairs_begin_ = next[2 * point_count];
  measurements_.resize(problem.measurements.size());
  for (std::size_t i = 0; i < problem.measurements.size(); ++i) {
    const BundleProblem::Measurement& measurement = problem.measurements[i];
    measurements_[next[key(measurement)]++] = {measurement.pixel, 1 / measurement.sigma_px,
                                               measurement.camera, measurement.point, static_cast<int>(i)};
  }
}

void BundleEvaluation::PackPose(const Rigid3& camera_from_map, double* pose) {
  std::copy_n(camera_from_map.rotation.quaternion().coeffs().data(), 4, pose);
  std::copy_n(camera_from_map.translation.data(), 3, pose + 4);
}

Rigid3 BundleEvaluation::UnpackPose(const double* pose) {
  return {Rotation3(Eigen::Quaterniond(pose[3], pose[0], pose[1], pose[2])),
          Eigen::Vector3d(pose[4], pose[5], pose[6])};
}

void BundleEvaluation::UpdateCameras() {
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const Rigid3 camera_from_map = UnpackPose(pose_state(static_cast<int>(i)));
    cameras_[i].rotation = camera_from_map.rotation.matrix();
    cameras_[i].translation = camera_from_map.translation;
  }
}

bool BundleEvaluation::Project(std::size_t measurement, Eigen::Vector3d* point_in_camera,
                               Eigen::Vector2d* residual, Eigen::Matrix<double, 2, 3>* jacobian) {
  const PackedMeasurement& data = measurements_[measurement];
  const CameraCache& camera = cameras_[static_cast<std::size_t>(data.camera)];
  const Eigen::Vector3d point(point_state(data.point));
  point_in_camera->noalias() = camera.rotation * point + camera.translation;
  double& squared_norm = squared_norms_[measurement];
  Eigen::Vector2d pixel;
  if (!camera.model->Project(*point_in_camera, &pixel, jacobian)) {
    squared_norm = std::numeric_limits<double>::infinity();
    return false;
  }
  *residual = data.inverse_sigma * (pixel - data.pixel);
  squared_norm = residual->squaredNorm();
  if (jacobian != nullptr) {
    *jacobian *= data.inverse_sigma;
  }
  return std::isfinite(squared_norm);
}

void BundleEvaluation::AddFixedCamera(std::size_t measurement, bool with_jacobians, NormalEquations* sum) {
  Eigen::Vector3d point_in_camera;
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 3> jacobian;
  if (!Project(measurement, &point_in_camera, &residual, with_jacobians ? &jacobian : nullptr)) {
    sum->cost += CostOfUnprojectable(loss_, threshold_);
    return;
  }
  const RobustValue value = EvaluateLoss(loss_, threshold_, squared_norms_[measurement]);
  sum->cost += value.cost;
  if (with_jacobians && value.slope > 0) {
    const auto camera = static_cast<std::size_t>(measurements_[measurement].camera);
    const Eigen::Matrix<double, 2, 3> by_point = jacobian * cameras_[camera].rotation;
    sum->hessian.noalias() += value.slope * by_point.transpose() * by_point;
    sum->gradient.noalias() += value.slope * by_point.transpose() * residual;
  }
}

void BundleEvaluation::EvaluatePair(std::size_t measurement, bool with_jacobians, Pair* pair) {
  Eigen::Vector3d x;
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 3> jacobian;
  pair->residual.fill(0);
  const bool projects = Project(measurement, &x, &residual, with_jacobians ? &jacobian : nullptr);
  const double squared_norm = squared_norms_[measurement];
  const RobustValue value = projects ? EvaluateLoss(loss_, threshold_, squared_norm)
                                     : RobustValue{CostOfUnprojectable(loss_, threshold_), 0};
  cost_ += value.cost;
  if (!(value.slope > 0)) {
    loose_cost_ += value.cost;
    pair->by_pose.fill(0);
    pair->by_point.fill(0);
    return;
  }
  loose_cost_ += std::max(0.0, value.cost - value.slope * squared_norm);
  const double weight = std::sqrt(value.slope);
  pair->residual = {weight * residual.x(), weight * residual.y()};
  if (!with_jacobians) {
    return;
  }
  // d x / d (v, w) = (I, -[x]), because the twist acts on the left: x + v + w cross x.
  jacobian *= weight;
  for (int row = 0; row < 2; ++row) {
    const Eigen::Vector3d by_v = jacobian.row(row);
    const Eigen::Vector3d by_w = x.cross(by_v);
    double* out = pair->by_pose.data() + row * kPoseSize;
    std::copy_n(by_v.data(), 3, out);
    std::copy_n(by_w.data(), 3, out + 3);
    out[6] = 0;
  }
  Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>(pair->by_point.data()).noalias() =
      jacobian * cameras_[static_cast<std::size_t>(pair->camera)].rotation;
}

// The upper triangular U with U^T U = hessian, and the residual u with U^T u = gradient.
void BundleEvaluation::Condense(const NormalEquations& sum, bool with_jacobians, Condensed* result) {
  result->residual.fill(0);
  if (!with_jacobians) {
    result->residual[3] = std::sqrt(sum.cost);
    return;
  }
  Eigen::Matrix3d hessian = sum.hessian;
  Eigen::Vector3d gradient = sum.gradient;
  const double smallest_pivot = kPivotRatio * hessian.diagonal().maxCoeff();
  double explained = 0;
  result->by_point.fill(0);
  for (int i = 0; i < 3; ++i) {
    if (!(hessian(i, i) > smallest_pivot)) {
      continue;
    }
    const double root = std::sqrt(hessian(i, i));
    double* row = result->by_point.data() + 3 * i;
    for (int j = i; j < 3; ++j) {
      row[j] = hessian(i, j) / root;
    }
    const double residual = gradient[i] / root;
    result->residual[static_cast<std::size_t>(i)] = residual;
    explained += residual * residual;
    for (int j = i + 1; j < 3; ++j) {
      gradient[j] -= row[j] * residual;
      for (int k = j; k < 3; ++k) {
        hessian(j, k) -= row[j] * row[k];
      }
    }
  }
  result->residual[3] = std::sqrt(std::max(0.0, sum.cost - explained));
}

bool BundleEvaluation::Evaluate(bool with_jacobians) {
  UpdateCameras();
  cost_ = 0;
  loose_cost_ = 0;
  int until_look = 0;
  const auto is_interrupted = [&] {
    if (until_look-- > 0) {
      return false;
    }
    until_look = kInterruptStride;
    return interrupted();
  };
  std::size_t next = 0;
  for (; next < condensed_begin_; ++next) {
    Eigen::Vector3d point_in_camera;
    Eigen::Vector2d residual;
    if (is_interrupted()) {
      return false;
    }
    Project(next, &point_in_camera, &residual, nullptr);
  }
  for (std::size_t i = 0; i < condensed_.size(); ++i) {
    NormalEquations sum;
    for (; next < condensed_ends_[i]; ++next) {
      if (is_interrupted()) {
        return false;
      }
      AddFixedCamera(next, with_jacobians, &sum);
    }
    Condense(sum, with_jacobians, &condensed_[i]);
    cost_ += sum.cost;
  }
  for (Pair& pair : pairs_) {
    if (is_interrupted()) {
      return false;
    }
    EvaluatePair(next++, with_jacobians, &pair);
  }
  remainder_ = std::sqrt(loose_cost_ + tightening_cost_);
  return true;
}

double BundleEvaluation::CostOf(std::size_t measurement) const {
  const double squared_norm = squared_norms_[measurement];
  return std::isfinite(squared_norm) ? EvaluateLoss(loss_, threshold_, squared_norm).cost
                                     : CostOfUnprojectable(loss_, threshold_);
}

void BundleEvaluation::TightenThreshold(double threshold) {
  threshold_ = threshold;
  double cost = 0;
  for (std::size_t i = condensed_begin_; i < measurements_.size(); ++i) {
    cost += CostOf(i);
  }
  tightening_cost_ += std::max(0.0, cost_ - cost);
  cost_ = cost;
}

void BundleEvaluation::EvaluateNorms() {
  UpdateCameras();
  Eigen::Vector3d point_in_camera;
  Eigen::Vector2d residual;
  for (std::size_t i = 0; i < measurements_.size(); ++i) {
    Project(i, &point_in_camera, &residual, nullptr);
  }
}

}  // namespace docent::engine

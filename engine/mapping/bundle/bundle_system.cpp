// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle/bundle_system.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "engine/mapping/bundle/robust_loss.h"

namespace docent::engine {
namespace {

// Lower limit of the curvature by which the damping is multiplied: an unknown without measurements stays
// where it is.
constexpr double kMinCurvature = 1e-6;
// Points between two checks of the interrupt: well below 0.1 ms.
constexpr std::size_t kInterruptStride = 32;

using Twist = Eigen::Matrix<double, 6, 1>;

// d (point in camera) / d (v, w) = (I, -[x]) because the twist acts on the left: x + v + w cross x.
Eigen::Matrix<double, 2, 6> ByPose(const Eigen::Matrix<double, 2, 3>& jacobian, const Eigen::Vector3d& x) {
  Eigen::Matrix<double, 2, 6> by_pose;
  by_pose.leftCols<3>() = jacobian;
  by_pose.col(3) = jacobian.col(2) * x.y() - jacobian.col(1) * x.z();
  by_pose.col(4) = jacobian.col(0) * x.z() - jacobian.col(2) * x.x();
  by_pose.col(5) = jacobian.col(1) * x.x() - jacobian.col(0) * x.y();
  return by_pose;
}

double InverseSigma(const BundleProblem::Measurement& measurement) {
  return 1 / static_cast<double>(measurement.sigma_px);
}

}  // namespace

BundleSystem::BundleSystem(const BundleProblem& problem, RobustLoss loss, const std::atomic<bool>* interrupt)
    : loss_(loss), interrupt_(interrupt), measurements_(problem.measurements), reduced_(std::vector<int>()) {
  Pack(problem);
  reduced_ = MakeReduced();
  next_cameras_ = cameras_;
  next_positions_ = positions_;
  squared_norms_.resize(order_.size());
  next_squared_norms_.resize(order_.size());
  squared_norms_ = EvaluateAt(problem);
  const auto size = static_cast<Eigen::Index>(6 * free_cameras_.size());
  camera_step_ = right_hand_side_ = camera_gradient_ = camera_damping_ = Eigen::VectorXd::Zero(size);
  eliminated_.resize(free_points_.size());
}

const std::vector<double>& BundleSystem::EvaluateAt(const BundleProblem& problem) {
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    next_cameras_[i].camera_from_map = problem.cameras[i].camera_from_map;
    next_cameras_[i].rotation = problem.cameras[i].camera_from_map.rotation.matrix();
  }
  for (const Point& point : points_) {
    const Eigen::Vector3d& position = problem.points[static_cast<std::size_t>(point.index)].position;
    for (std::size_t i = point.begin; i < point.end; ++i) {
      const Measurement& measurement = MeasurementAt(i);
      next_squared_norms_[i] =
          SquaredNorm(measurement, next_cameras_[static_cast<std::size_t>(measurement.camera)], position);
    }
  }
  return next_squared_norms_;
}

// A counting sort by point. Cameras and points that are fixed, not finite or never measured are not unknowns.
void BundleSystem::Pack(const BundleProblem& problem) {
  const std::size_t camera_count = problem.cameras.size(), point_count = problem.points.size();
  std::vector<char> measured(camera_count, 0);
  std::vector<std::size_t> next(point_count + 1, 0);
  for (const BundleProblem::Measurement& measurement : problem.measurements) {
    ++next[static_cast<std::size_t>(measurement.point) + 1];
    measured[static_cast<std::size_t>(measurement.camera)] = 1;
  }
  std::partial_sum(next.begin(), next.end(), next.begin());
  cameras_.resize(camera_count);
  for (std::size_t i = 0; i < camera_count; ++i) {
    const BundleProblem::Camera& camera = problem.cameras[i];
    cameras_[i].model = camera.model.get();
    cameras_[i].camera_from_map = camera.camera_from_map;
    cameras_[i].rotation = camera.camera_from_map.rotation.matrix();
    const bool finite = camera.camera_from_map.translation.allFinite() &&
                        camera.camera_from_map.rotation.quaternion().coeffs().allFinite();
    if (camera.fixed || !finite || !measured[i]) continue;
    cameras_[i].unknown = static_cast<int>(free_cameras_.size());
    free_cameras_.push_back(static_cast<int>(i));
  }
  positions_.reserve(point_count);
  points_.reserve(point_count);
  for (std::size_t i = 0; i < point_count; ++i) {
    positions_.push_back(problem.points[i].position);
    if (next[i] == next[i + 1]) continue;
    Point point;
    point.begin = next[i];
    point.end = next[i + 1];
    point.index = static_cast<int>(i);
    if (!problem.points[i].fixed && positions_[i].allFinite()) {
      point.unknown = static_cast<int>(free_points_.size());
      free_points_.push_back(point.index);
    }
    points_.push_back(point);
  }
  order_.resize(measurements_.size());
  for (std::size_t i = 0; i < measurements_.size(); ++i)
    order_[next[static_cast<std::size_t>(measurements_[i].point)]++] = static_cast<int>(i);
}

// Two cameras are coupled if they measured the same free point.
SkylineCholesky BundleSystem::MakeReduced() const {
  std::vector<int> first(free_cameras_.size());
  std::iota(first.begin(), first.end(), 0);
  for (const Point& point : points_) {
    if (point.unknown < 0) continue;
    int least = std::numeric_limits<int>::max();
    for (std::size_t i = point.begin; i < point.end; ++i) {
      const int unknown = cameras_[static_cast<std::size_t>(MeasurementAt(i).camera)].unknown;
      if (unknown >= 0) least = std::min(least, unknown);
    }
    for (std::size_t i = point.begin; i < point.end; ++i) {
      const int unknown = cameras_[static_cast<std::size_t>(MeasurementAt(i).camera)].unknown;
      if (unknown < 0) continue;
      int& begin = first[static_cast<std::size_t>(unknown)];
      begin = std::min(begin, least);
    }
  }
  return SkylineCholesky(first);
}

double BundleSystem::SquaredNorm(const Measurement& measurement, const Camera& camera,
                                 const Eigen::Vector3d& point) const {
  Eigen::Vector2d pixel;
  const Eigen::Vector3d in_camera = camera.rotation * point + camera.camera_from_map.translation;
  const Eigen::Vector2d measured = measurement.pixel.cast<double>();
  if (!camera.model->ProjectAtExposureOf(measured, in_camera, &pixel, nullptr))
    return std::numeric_limits<double>::infinity();
  const double inverse_sigma = InverseSigma(measurement);
  const double squared_norm = (inverse_sigma * (pixel - measured)).squaredNorm();
  return std::isfinite(squared_norm) ? squared_norm : std::numeric_limits<double>::infinity();
}

bool BundleSystem::Linearize(const Measurement& measurement, double squared_norm,
                             const Eigen::Vector3d& point, double threshold, Linearized* result) const {
  if (!std::isfinite(squared_norm)) return false;
  const double slope = EvaluateLoss(loss_, threshold, squared_norm).slope;
  if (!(slope > 0)) return false;
  const Camera& camera = cameras_[static_cast<std::size_t>(measurement.camera)];
  result->in_camera.noalias() = camera.rotation * point + camera.camera_from_map.translation;
  Eigen::Vector2d pixel;
  const Eigen::Vector2d measured = measurement.pixel.cast<double>();
  if (!camera.model->ProjectAtExposureOf(measured, result->in_camera, &pixel, &result->jacobian))
    return false;
  const double scale = std::sqrt(slope) * InverseSigma(measurement);
  result->residual = scale * (pixel - measured);
  result->jacobian *= scale;
  return true;
}

bool BundleSystem::Reduce(double threshold, double damping) {
  reduced_.SetZero();
  camera_gradient_.setZero();
  camera_damping_.setZero();
  right_hand_side_.setZero();
  max_gradient_ = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (i % kInterruptStride == 0 && interrupted()) return false;
    ReducePoint(points_[i], threshold, damping);
  }
  for (std::size_t i = 0; i < free_cameras_.size(); ++i) {
    const auto begin = static_cast<Eigen::Index>(6 * i);
    auto curvature = camera_damping_.segment<6>(begin);
    curvature = damping * curvature.cwiseMax(kMinCurvature);
    reduced_.At(static_cast<int>(i), static_cast<int>(i)).diagonal() += curvature;
  }
  right_hand_side_ -= camera_gradient_;
  if (!free_cameras_.empty()) max_gradient_ = std::max(max_gradient_, camera_gradient_.cwiseAbs().maxCoeff());
  return true;
}

void BundleSystem::ReducePoint(const Point& point, double threshold, double damping) {
  const Eigen::Vector3d& position = positions_[static_cast<std::size_t>(point.index)];
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
  couplings_.clear();
  Linearized linearized;
  for (std::size_t i = point.begin; i < point.end; ++i) {
    const Measurement& measurement = MeasurementAt(i);
    const Camera& camera = cameras_[static_cast<std::size_t>(measurement.camera)];
    if (camera.unknown < 0 && point.unknown < 0) continue;
    if (!Linearize(measurement, squared_norms_[i], position, threshold, &linearized)) continue;
    const Eigen::Matrix<double, 2, 3> by_point = linearized.jacobian * camera.rotation;
    if (point.unknown >= 0) {
      hessian.noalias() += by_point.transpose() * by_point;
      gradient.noalias() += by_point.transpose() * linearized.residual;
    }
    if (camera.unknown < 0) continue;
    const Eigen::Matrix<double, 2, 6> by_pose = ByPose(linearized.jacobian, linearized.in_camera);
    const Eigen::Matrix<double, 6, 6> curvature = by_pose.transpose() * by_pose;
    reduced_.At(camera.unknown, camera.unknown) += curvature;
    camera_damping_.segment<6>(6 * camera.unknown) += curvature.diagonal();
    camera_gradient_.segment<6>(6 * camera.unknown) += by_pose.transpose() * linearized.residual;
    if (point.unknown < 0) continue;
    couplings_.emplace_back();
    couplings_.back().camera = camera.unknown;
    couplings_.back().block.noalias() = by_pose.transpose() * by_point;
  }
  if (point.unknown >= 0) Eliminate(point, damping, hessian, gradient);
}

void BundleSystem::Eliminate(const Point& point, double damping, const Eigen::Matrix3d& hessian,
                             const Eigen::Vector3d& gradient) {
  Eliminated& result = eliminated_[static_cast<std::size_t>(point.unknown)];
  result.gradient = gradient;
  result.damping = damping * hessian.diagonal().cwiseMax(kMinCurvature);
  max_gradient_ = std::max(max_gradient_, gradient.cwiseAbs().maxCoeff());
  Eigen::Matrix3d damped = hessian;
  damped.diagonal() += result.damping;
  const Eigen::LLT<Eigen::Matrix3d> factor(damped);
  if (factor.info() != Eigen::Success) {
    result.inverse_hessian.setZero();  // the point does not move in this step
    return;
  }
  result.inverse_hessian = factor.solve(Eigen::Matrix3d::Identity());
  for (std::size_t a = 0; a < couplings_.size(); ++a) {
    Coupling& coupling = couplings_[a];
    coupling.solved.noalias() = coupling.block * result.inverse_hessian;
    right_hand_side_.segment<6>(6 * coupling.camera) += coupling.solved * gradient;
    for (std::size_t b = 0; b <= a; ++b) {
      const Coupling& other = couplings_[b];
      const bool ordered = coupling.camera >= other.camera;
      const Coupling& row = ordered ? coupling : other;
      const Coupling& column = ordered ? other : coupling;
      auto target = reduced_.At(row.camera, column.camera);
      target.noalias() -= row.solved * column.block.transpose();
      // One image may contain two measurements of a point: no map has this, but the problem allows it.
      if (a != b && row.camera == column.camera) target.noalias() -= column.solved * row.block.transpose();
    }
  }
}

BundleSystem::Outcome BundleSystem::Step(double threshold, double damping) {
  if (!Reduce(threshold, damping)) return Outcome::kInterrupted;
  const auto factored = reduced_.Factor([this] { return interrupted(); });
  if (factored == SkylineCholesky::Outcome::kInterrupted) return Outcome::kInterrupted;
  if (factored == SkylineCholesky::Outcome::kNotPositive) return Outcome::kSingular;
  camera_step_ = right_hand_side_;
  reduced_.Solve(&camera_step_);
  if (!camera_step_.allFinite()) return Outcome::kSingular;
  return BackSubstitute(threshold) ? Outcome::kDone : Outcome::kInterrupted;
}

// Back-substitution: moves the points to the optimum for the moved cameras, and evaluates all residuals
// there.
bool BundleSystem::BackSubstitute(double threshold) {
  predicted_decrease_ = 0.5 * camera_step_.dot(camera_damping_.cwiseProduct(camera_step_) - camera_gradient_);
  double squared_length = camera_step_.squaredNorm(), squared_state = 0;
  for (std::size_t i = 0; i < free_cameras_.size(); ++i) {
    const auto index = static_cast<std::size_t>(free_cameras_[i]);
    const Twist twist = camera_step_.segment<6>(static_cast<Eigen::Index>(6 * i));
    next_cameras_[index].camera_from_map = Rigid3::Exp(twist) * cameras_[index].camera_from_map;
    next_cameras_[index].rotation = next_cameras_[index].camera_from_map.rotation.matrix();
    squared_state += 1 + cameras_[index].camera_from_map.translation.squaredNorm();
  }
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (i % kInterruptStride == 0 && interrupted()) return false;
    BackSubstitutePoint(points_[i], threshold);
    if (points_[i].unknown < 0) continue;
    const auto index = static_cast<std::size_t>(points_[i].index);
    squared_length += (next_positions_[index] - positions_[index]).squaredNorm();
    squared_state += positions_[index].squaredNorm();
  }
  relative_length_ = std::sqrt(squared_length / std::max(squared_state, 1e-300));
  return true;
}

void BundleSystem::BackSubstitutePoint(const Point& point, double threshold) {
  const auto index = static_cast<std::size_t>(point.index);
  if (point.unknown >= 0) {
    const Eliminated& eliminated = eliminated_[static_cast<std::size_t>(point.unknown)];
    Eigen::Vector3d gradient = eliminated.gradient;
    Linearized linearized;
    for (std::size_t i = point.begin; i < point.end; ++i) {
      const Camera& camera = cameras_[static_cast<std::size_t>(MeasurementAt(i).camera)];
      if (camera.unknown < 0) continue;
      if (!Linearize(MeasurementAt(i), squared_norms_[i], positions_[index], threshold, &linearized))
        continue;
      const Twist twist = camera_step_.segment<6>(6 * camera.unknown);
      const Eigen::Vector3d moved = twist.head<3>() + twist.tail<3>().cross(linearized.in_camera);
      gradient.noalias() +=
          camera.rotation.transpose() * (linearized.jacobian.transpose() * (linearized.jacobian * moved));
    }
    const Eigen::Vector3d step = -(eliminated.inverse_hessian * gradient);
    next_positions_[index] = positions_[index] + step;
    predicted_decrease_ += 0.5 * step.dot(eliminated.damping.cwiseProduct(step) - eliminated.gradient);
  }
  for (std::size_t i = point.begin; i < point.end; ++i) {
    const auto camera = static_cast<std::size_t>(MeasurementAt(i).camera);
    if (point.unknown < 0 && cameras_[camera].unknown < 0) {
      next_squared_norms_[i] = squared_norms_[i];
      continue;
    }
    next_squared_norms_[i] = SquaredNorm(MeasurementAt(i), next_cameras_[camera], next_positions_[index]);
  }
}

void BundleSystem::Accept() {
  // Both states are equal in everything that is fixed, and a step overwrites everything that is free.
  cameras_.swap(next_cameras_);
  positions_.swap(next_positions_);
  squared_norms_.swap(next_squared_norms_);
}

void BundleSystem::WriteBack(BundleProblem* problem) const {
  for (const int i : free_cameras_) {
    const auto index = static_cast<std::size_t>(i);
    problem->cameras[index].camera_from_map = cameras_[index].camera_from_map;
  }
  for (const int i : free_points_) {
    const auto index = static_cast<std::size_t>(i);
    problem->points[index].position = positions_[index];
  }
}

}  // namespace docent::engine

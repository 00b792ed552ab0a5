// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/ceres_bundle.h"

#include <ceres/cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>
#include <ceres/sized_cost_function.h>
#include <ceres/solver.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <vector>

namespace docent::bench {

namespace {

using engine::BundleProblem;

// A pose as Ceres stores it: quaternion (x, y, z, w), then translation.
constexpr int kPoseSize = 7, kTwistSize = 6;
using Pose = std::array<double, kPoseSize>;
using TwistJacobian = Eigen::Matrix<double, 2, kTwistSize>;

Pose ToPose(const engine::Rigid3& transform) {
  Pose pose;
  Eigen::Map<Eigen::Quaterniond>(pose.data()) = transform.rotation.quaternion();
  Eigen::Map<Eigen::Vector3d>(pose.data() + 4) = transform.translation;
  return pose;
}

engine::Rigid3 ToRigid3(const double* pose) {
  return {engine::Rotation3(Eigen::Map<const Eigen::Quaterniond>(pose)),
          Eigen::Map<const Eigen::Vector3d>(pose + 4)};
}

// Twists are applied on the left, as in AdjustBundle. The cost functions give derivatives by the twist in the
// first six columns, so that the Jacobian of Plus is the identity above a row of zeros.
class TwistManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return kPoseSize; }
  int TangentSize() const override { return kTwistSize; }
  bool Plus(const double* pose, const double* twist, double* result) const override {
    const Eigen::Map<const Eigen::Matrix<double, 6, 1>> delta(twist);
    const Pose moved = ToPose(engine::Rigid3::Exp(delta) * ToRigid3(pose));
    std::copy(moved.begin(), moved.end(), result);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, kPoseSize, kTwistSize, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  // Only Plus is needed to minimize.
  bool Minus(const double*, const double*, double*) const override { return false; }
  bool MinusJacobian(const double*, double*) const override { return false; }
};

class Reprojection : public ceres::SizedCostFunction<2, kPoseSize, 3> {
 public:
  Reprojection(const engine::CameraModel* model, const BundleProblem::Measurement* measurement)
      : model_(*model), measurement_(*measurement) {}

  bool Evaluate(const double* const* parameters, double* residual, double** jacobians) const override {
    const Eigen::Map<const Eigen::Quaterniond> rotation(parameters[0]);
    const Eigen::Map<const Eigen::Vector3d> translation(parameters[0] + 4), point(parameters[1]);
    const Eigen::Matrix3d matrix = rotation.toRotationMatrix();
    const Eigen::Vector3d in_camera = matrix * point + translation;
    const double weight = 1 / static_cast<double>(measurement_.sigma_px);
    Eigen::Vector2d pixel;
    Eigen::Matrix<double, 2, 3> by_point;
    if (!model_.Project(in_camera, &pixel, &by_point)) return false;
    Eigen::Map<Eigen::Vector2d> result(residual);
    result = weight * (pixel - measurement_.pixel.cast<double>());
    if (jacobians == nullptr) return true;
    by_point *= weight;
    if (jacobians[0] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, kPoseSize, Eigen::RowMajor>> by_pose(jacobians[0]);
      Eigen::Matrix3d cross;
      cross << 0, -in_camera.z(), in_camera.y(), in_camera.z(), 0, -in_camera.x(), -in_camera.y(),
          in_camera.x(), 0;
      by_pose.leftCols<3>() = by_point;
      by_pose.middleCols<3>(3) = -by_point * cross;
      by_pose.col(6).setZero();
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>> by_position(jacobians[1]);
      by_position = by_point * matrix;
    }
    return true;
  }

 private:
  const engine::CameraModel& model_;
  const BundleProblem::Measurement& measurement_;
};

double Milliseconds(std::chrono::steady_clock::duration duration) {
  return std::chrono::duration<double, std::milli>(duration).count();
}

}  // namespace

CeresSummary SolveWithCeres(const CeresOptions& options, BundleProblem* problem) {
  const auto begin = std::chrono::steady_clock::now();
  std::vector<Pose> poses;
  poses.reserve(problem->cameras.size());
  for (const BundleProblem::Camera& camera : problem->cameras)
    poses.push_back(ToPose(camera.camera_from_map));
  TwistManifold manifold;
  const std::unique_ptr<ceres::LossFunction> loss =
      options.loss == engine::RobustLoss::kTukey
          ? std::unique_ptr<ceres::LossFunction>(new ceres::TukeyLoss(options.threshold))
          : std::unique_ptr<ceres::LossFunction>(new ceres::HuberLoss(options.threshold));
  ceres::Problem::Options ownership;
  ownership.manifold_ownership = ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.disable_all_safety_checks = true;
  ceres::Problem ceres_problem(ownership);
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    ceres_problem.AddParameterBlock(poses[i].data(), kPoseSize, &manifold);
    ordering->AddElementToGroup(poses[i].data(), 1);
    if (problem->cameras[i].fixed) ceres_problem.SetParameterBlockConstant(poses[i].data());
  }
  for (BundleProblem::Point& point : problem->points) {
    ceres_problem.AddParameterBlock(point.position.data(), 3);
    ordering->AddElementToGroup(point.position.data(), 0);
    if (point.fixed) ceres_problem.SetParameterBlockConstant(point.position.data());
  }
  for (const BundleProblem::Measurement& measurement : problem->measurements) {
    const auto camera = static_cast<std::size_t>(measurement.camera);
    ceres_problem.AddResidualBlock(
        new Reprojection(problem->cameras[camera].model.get(), &measurement), loss.get(),
        poses[camera].data(), problem->points[static_cast<std::size_t>(measurement.point)].position.data());
  }
  CeresSummary summary;
  summary.prepare_ms = Milliseconds(std::chrono::steady_clock::now() - begin);
  ceres::Solver::Options solver;
  solver.linear_solver_type = options.sparse ? ceres::SPARSE_SCHUR : ceres::DENSE_SCHUR;
  solver.linear_solver_ordering = ordering;
  solver.max_num_iterations = options.max_iterations;
  solver.num_threads = 1;
  solver.function_tolerance = 1e-6;  // these three as in bundle_adjustment.cpp
  solver.parameter_tolerance = 1e-9;
  solver.gradient_tolerance = 1e-10;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary solved;
  ceres::Solve(solver, &ceres_problem, &solved);
  summary.iterations = static_cast<int>(solved.iterations.size()) - 1;  // the first is the initial state
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!problem->cameras[i].fixed) problem->cameras[i].camera_from_map = ToRigid3(poses[i].data());
  }
  return summary;
}

}  // namespace docent::bench

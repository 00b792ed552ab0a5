// SPDX-License-Identifier: Apache-2.0
#include "app/calibration/lens_solver.h"

#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

namespace docent::app {

namespace {

using engine::CameraModel;
using engine::LensModel;
using engine::Rigid3;
using engine::Rotation3;

using Numbers = std::array<double, 9>;  // fx fy cx cy, distortion.

std::optional<CameraModel> MakeCamera(LensModel lens, int width_px, int height_px, const double* numbers) {
  CameraModel::Intrinsics intrinsics{width_px, height_px, numbers[0], numbers[1], numbers[2], numbers[3]};
  std::array<double, 5> distortion{};
  std::copy_n(numbers + 4, IntrinsicCount(lens) - 4, distortion.begin());
  if (CameraModel::Validate(lens, intrinsics, distortion)) return std::nullopt;
  return CameraModel(lens, intrinsics, distortion);
}

Numbers NumbersOf(const CameraModel& camera) {
  const auto& in = camera.intrinsics();
  Numbers numbers{in.fx, in.fy, in.cx, in.cy};
  std::copy(camera.distortion().begin(), camera.distortion().end(), numbers.begin() + 4);
  return numbers;
}

// The derivative of Exp(w) x by w is -[Exp(w) x] LeftJacobian(w) (Barfoot 2017, section 7.1.5).
Eigen::Matrix3d LeftJacobian(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  const Eigen::Matrix3d hat = engine::Hat(w);
  if (angle < 1e-6) return Eigen::Matrix3d::Identity() + 0.5 * hat;
  return Eigen::Matrix3d::Identity() + (1 - std::cos(angle)) / (angle * angle) * hat +
         (angle - std::sin(angle)) / (angle * angle * angle) * hat * hat;
}

// Reprojection residuals of all corners of one view. Parameter blocks: the intrinsics, and the pose as
// rotation vector and translation.
class ViewCost : public ceres::CostFunction {
 public:
  ViewCost(LensModel lens, int width_px, int height_px, const BoardView* view)
      : lens_(lens), width_px_(width_px), height_px_(height_px), view_(view) {
    set_num_residuals(2 * static_cast<int>(view->pixels.size()));
    mutable_parameter_block_sizes()->push_back(IntrinsicCount(lens));
    mutable_parameter_block_sizes()->push_back(6);
  }

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const auto camera = MakeCamera(lens_, width_px_, height_px_, parameters[0]);
    if (!camera) return false;
    const Eigen::Map<const Eigen::Vector3d> rotation_vector(parameters[1]), translation(parameters[1] + 3);
    const Eigen::Matrix3d rotation = Rotation3::Exp(rotation_vector).matrix(),
                          left = LeftJacobian(rotation_vector);
    double* const pose_jacobian = jacobians ? jacobians[1] : nullptr;
    for (std::size_t i = 0; i < view_->pixels.size(); ++i) {
      const Eigen::Vector2d& on_board = view_->points_on_board[i];
      const Eigen::Vector3d rotated = rotation.leftCols<2>() * on_board;
      Eigen::Vector2d pixel;
      Eigen::Matrix<double, 2, 3> by_point;
      if (!camera->Project(rotated + translation, &pixel, &by_point)) return false;
      Eigen::Map<Eigen::Vector2d>(residuals + 2 * i) = pixel - view_->pixels[i];
      if (pose_jacobian == nullptr) continue;
      Eigen::Map<Eigen::Matrix<double, 2, 6, Eigen::RowMajor>> by_pose(pose_jacobian + 12 * i);
      by_pose.leftCols<3>() = -by_point * engine::Hat(rotated) * left;
      by_pose.rightCols<3>() = by_point;
    }
    return !jacobians || !jacobians[0] || DeriveByIntrinsics(parameters, rotation, translation, jacobians[0]);
  }

 private:
  // Central differences, because the camera models have no derivatives with respect to their intrinsics,
  // which only calibration needs. With a step of 1e-6 they are exact to ten digits.
  bool DeriveByIntrinsics(const double* const* parameters, const Eigen::Matrix3d& rotation,
                          const Eigen::Vector3d& translation, double* jacobian) const {
    const int count = IntrinsicCount(lens_);
    for (int n = 0; n < count; ++n) {
      const double step = 1e-6 * std::max(1.0, std::abs(parameters[0][n]));
      Numbers low{}, high{};
      std::copy_n(parameters[0], count, low.begin());
      high = low;
      low[n] -= step;
      high[n] += step;
      const auto below = MakeCamera(lens_, width_px_, height_px_, low.data());
      const auto above = MakeCamera(lens_, width_px_, height_px_, high.data());
      if (!below || !above) return false;
      for (std::size_t i = 0; i < view_->pixels.size(); ++i) {
        const Eigen::Vector3d point = rotation.leftCols<2>() * view_->points_on_board[i] + translation;
        const auto a = below->Project(point), b = above->Project(point);
        if (!a || !b) return false;
        const Eigen::Vector2d slope = (*b - *a) / (2 * step);
        jacobian[(2 * i) * count + n] = slope.x();
        jacobian[(2 * i + 1) * count + n] = slope.y();
      }
    }
    return true;
  }

  const LensModel lens_;
  const int width_px_, height_px_;
  const BoardView* const view_;
};

// Estimates the pose of a plane from the rays of its corners through the homography between plane and rays
// (Zhang 2000, section 3.1).
std::optional<Rigid3> PoseFromRays(const CameraModel& camera, const BoardView& view) {
  std::vector<Eigen::Vector3d> rays;
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < view.pixels.size(); ++i) {
    const auto ray = camera.Unproject(view.pixels[i]);
    if (!ray) continue;
    rays.push_back(*ray);
    points.push_back(view.points_on_board[i]);
  }
  if (rays.size() < 4) return std::nullopt;
  // Board points are centred and scaled to at most one, so that the equations are well conditioned.
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const auto& point : points) middle += point / static_cast<double>(points.size());
  double scale = 0;
  for (const auto& point : points) scale = std::max(scale, (point - middle).norm());
  if (scale <= 0) return std::nullopt;
  Eigen::MatrixXd equations(3 * rays.size(), 9);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    // ray x (H p) = 0 holds for rays of any direction, also beyond 90 degrees.
    const Eigen::Matrix3d cross = engine::Hat(rays[i]);
    const Eigen::Vector3d p((points[i].x() - middle.x()) / scale, (points[i].y() - middle.y()) / scale, 1);
    for (int column = 0; column < 3; ++column)
      equations.block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * column) = cross * p[column];
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(equations, Eigen::ComputeFullV);
  const Eigen::VectorXd solution = svd.matrixV().col(8);
  Eigen::Matrix3d h;
  for (int column = 0; column < 3; ++column) h.col(column) = solution.segment<3>(3 * column);
  const double length = 0.5 * (h.col(0).norm() + h.col(1).norm());
  if (!(length > 1e-12)) return std::nullopt;
  h /= length;
  double front = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Eigen::Vector3d p((points[i].x() - middle.x()) / scale, (points[i].y() - middle.y()) / scale, 1);
    front += rays[i].dot(h * p);
  }
  if (front < 0) h = -h;
  Eigen::Matrix3d axes;
  axes << h.col(0), h.col(1), h.col(0).cross(h.col(1));
  const Eigen::JacobiSVD<Eigen::Matrix3d> nearest(axes, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d rotation = nearest.matrixU() * nearest.matrixV().transpose();
  if (rotation.determinant() < 0) return std::nullopt;
  const Eigen::Vector3d offset(middle.x(), middle.y(), 0);
  return Rigid3(Rotation3(rotation), scale * h.col(2) - rotation * offset);
}

struct Problem {
  LensModel lens;
  int width_px, height_px;
  Numbers numbers{};
  std::vector<std::array<double, 6>> poses;
};

std::array<double, 6> PoseNumbers(const Rigid3& pose) {
  const Eigen::Vector3d rotation = pose.rotation.Log();
  return {rotation.x(),         rotation.y(),         rotation.z(),
          pose.translation.x(), pose.translation.y(), pose.translation.z()};
}

// Minimizes in place. Returns half the sum of squared residuals; empty when the initial values are not
// usable.
std::optional<double> Minimize(const std::vector<BoardView>& views, int iterations, bool fixed_lens,
                               Problem* problem) {
  ceres::Problem ceres_problem;
  for (std::size_t i = 0; i < views.size(); ++i) {
    ceres_problem.AddResidualBlock(
        new ViewCost(problem->lens, problem->width_px, problem->height_px, &views[i]), nullptr,
        problem->numbers.data(), problem->poses[i].data());
  }
  if (fixed_lens) ceres_problem.SetParameterBlockConstant(problem->numbers.data());
  ceres::Solver::Options options;
  options.max_num_iterations = iterations;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.function_tolerance = 1e-12;
  options.parameter_tolerance = 1e-12;
  options.logging_type = ceres::SILENT;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (auto& pose : problem->poses) ordering->AddElementToGroup(pose.data(), 0);
  if (!fixed_lens) {
    ordering->AddElementToGroup(problem->numbers.data(), 1);
    options.linear_solver_ordering = ordering;
  } else {
    options.linear_solver_type = ceres::DENSE_QR;
  }
  ceres::Solver::Summary summary;
  ceres::Solve(options, &ceres_problem, &summary);
  if (!summary.IsSolutionUsable() || !std::isfinite(summary.final_cost)) return std::nullopt;
  return summary.final_cost;
}

// Evaluates the solution: residuals, and the information of the intrinsics with the poses eliminated.
std::optional<LensSolution> Describe(const std::vector<BoardView>& views, const Problem& problem) {
  const auto camera = MakeCamera(problem.lens, problem.width_px, problem.height_px, problem.numbers.data());
  if (!camera) return std::nullopt;
  const int count = IntrinsicCount(problem.lens);
  LensSolution solution;
  solution.camera = *camera;
  double squares = 0, corners = 0;
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(count, count);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const ViewCost cost(problem.lens, problem.width_px, problem.height_px, &views[i]);
    const auto size = static_cast<Eigen::Index>(2 * views[i].pixels.size());
    Eigen::VectorXd residuals(size);
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> by_lens(size, count),
        by_pose(size, 6);
    const double* parameters[2] = {problem.numbers.data(), problem.poses[i].data()};
    double* jacobians[2] = {by_lens.data(), by_pose.data()};
    if (!cost.Evaluate(parameters, residuals.data(), jacobians)) return std::nullopt;
    squares += residuals.squaredNorm();
    corners += static_cast<double>(views[i].pixels.size());
    solution.view_rms_px.push_back(std::sqrt(2 * residuals.squaredNorm() / static_cast<double>(size)));
    const Eigen::Map<const Eigen::Vector3d> rotation_vector(problem.poses[i].data()),
        translation(problem.poses[i].data() + 3);
    solution.camera_from_board.emplace_back(Rotation3::Exp(rotation_vector), translation);
    const Eigen::MatrixXd cross = by_lens.transpose() * by_pose;
    const Eigen::Matrix<double, 6, 6> pose = by_pose.transpose() * by_pose;
    solution.information.push_back(by_lens.transpose() * by_lens -
                                   cross * pose.ldlt().solve(cross.transpose()));
    all += solution.information.back();
  }
  solution.rms_px = std::sqrt(squares / corners);
  const double degrees_of_freedom =
      std::max(1.0, 2 * corners - count - 6 * static_cast<double>(views.size()));
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(all);
  solution.sigma = Eigen::VectorXd::Constant(count, std::numeric_limits<double>::infinity());
  if (lu.isInvertible())
    solution.sigma = (squares / degrees_of_freedom * lu.inverse().diagonal()).cwiseMax(0).cwiseSqrt();
  return solution;
}

// Initializes the poses of all views for the current lens. Returns false when one of them has no pose.
bool InitializePoses(const std::vector<BoardView>& views, Problem* problem) {
  const auto camera =
      MakeCamera(problem->lens, problem->width_px, problem->height_px, problem->numbers.data());
  if (!camera) return false;
  problem->poses.clear();
  for (const BoardView& view : views) {
    const auto pose = PoseFromRays(*camera, view);
    if (!pose) return false;
    problem->poses.push_back(PoseNumbers(*pose));
  }
  return true;
}

std::optional<LensSolution> Solve(const std::vector<BoardView>& views, Problem problem) {
  constexpr int kIterations = 200;
  if (!InitializePoses(views, &problem) || !Minimize(views, kIterations, false, &problem))
    return std::nullopt;
  return Describe(views, problem);
}

}  // namespace

int IntrinsicCount(LensModel lens) {
  switch (lens) {
    case LensModel::kRadialTangential:
      return 9;
    case LensModel::kFov:
      return 5;
    case LensModel::kKannalaBrandt:
      return 8;
  }
  return 4;
}

std::optional<LensSolution> SolveLens(LensModel lens, int width_px, int height_px,
                                      const std::vector<BoardView>& views) {
  if (views.size() < 2) return std::nullopt;
  // A few views, evenly spaced, select the best initial focal length.
  std::vector<BoardView> few;
  const std::size_t step = std::max<std::size_t>(1, views.size() / 8);
  for (std::size_t i = 0; i < views.size(); i += step) few.push_back(views[i]);
  std::optional<Problem> best;
  double least = std::numeric_limits<double>::max();
  for (const double focal : {0.4, 0.55, 0.75, 1.0, 1.4, 2.0}) {
    Problem problem{lens, width_px, height_px, {}, {}};
    problem.numbers = {focal * width_px, focal * width_px, 0.5 * (width_px - 1), 0.5 * (height_px - 1)};
    if (lens == LensModel::kFov) problem.numbers[4] = 0.6;
    constexpr int kFewIterations = 25;
    if (!InitializePoses(few, &problem)) continue;
    const auto cost = Minimize(few, kFewIterations, false, &problem);
    if (!cost || *cost >= least) continue;
    least = *cost;
    best = problem;
  }
  if (!best) return std::nullopt;
  return Solve(views, *best);
}

std::optional<LensSolution> RefineLens(const CameraModel& start, const std::vector<BoardView>& views) {
  return Solve(views, {start.lens(), start.width_px(), start.height_px(), NumbersOf(start), {}});
}

double LensSolution::FocalSigma() const {
  return std::max(sigma[0] / camera.intrinsics().fx, sigma[1] / camera.intrinsics().fy);
}

std::vector<std::vector<Eigen::Vector2d>> Residuals(const LensSolution& solution,
                                                    const std::vector<BoardView>& views) {
  std::vector<std::vector<Eigen::Vector2d>> residuals(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (std::size_t k = 0; k < views[i].pixels.size(); ++k) {
      const Eigen::Vector2d& point = views[i].points_on_board[k];
      const Eigen::Vector3d point_in_camera =
          solution.camera_from_board[i] * Eigen::Vector3d(point.x(), point.y(), 0);
      const Eigen::Vector2d& pixel = views[i].pixels[k];
      residuals[i].push_back(solution.camera.Project(point_in_camera).value_or(pixel) - pixel);
    }
  }
  return residuals;
}

std::optional<BoardPose> SolvePose(const CameraModel& camera, const BoardView& view) {
  Problem problem{camera.lens(), camera.width_px(), camera.height_px(), NumbersOf(camera), {}};
  const std::vector<BoardView> views = {view};
  constexpr int kIterations = 50;
  if (!InitializePoses(views, &problem)) return std::nullopt;
  const auto cost = Minimize(views, kIterations, true, &problem);
  if (!cost) return std::nullopt;
  const Eigen::Map<const Eigen::Vector3d> rotation_vector(problem.poses[0].data()),
      translation(problem.poses[0].data() + 3);
  return BoardPose{Rigid3(Rotation3::Exp(rotation_vector), translation),
                   std::sqrt(2 * *cost / static_cast<double>(view.pixels.size()))};
}

}  // namespace docent::app

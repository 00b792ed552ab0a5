// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/two_view_models.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "engine/geometry/tangent_basis.h"
#include "engine/initialization/five_point.h"

namespace docent::engine {
namespace {

using Columns = Eigen::Array<double, Eigen::Dynamic, 3>;

// matrix * ray for every row.
Columns MapRays(const Eigen::Matrix3d& matrix, const Columns& rays) {
  Columns result(rays.rows(), 3);
  for (int i = 0; i < 3; ++i)
    result.col(i) = matrix(i, 0) * rays.col(0) + matrix(i, 1) * rays.col(1) + matrix(i, 2) * rays.col(2);
  return result;
}

Eigen::ArrayXd Dot(const Columns& a, const Columns& b) {
  return a.col(0) * b.col(0) + a.col(1) * b.col(1) + a.col(2) * b.col(2);
}

// |x / |x| - y|^2 for unit y: the squared chord, which is also large for rays that point the opposite way.
Eigen::ArrayXd SquaredChord(const Columns& x, const Columns& y) {
  return 2 - 2 * Dot(x, y) / (Dot(x, x) + 1e-300).sqrt();
}

// Huber's loss of squared residuals, and its derivative with respect to them.
double HuberLoss(const Eigen::ArrayXd& squared, const Weights& weights, double threshold) {
  const Eigen::ArrayXd outside = 2 * threshold * squared.sqrt() - threshold * threshold;
  return (weights * (squared <= threshold * threshold).select(squared, outside)).sum();
}
double HuberSlope(double squared, double threshold) {
  return squared <= threshold * threshold ? 1.0 : threshold / std::sqrt(squared);
}

// Normal equations and gradient of a robust least-squares problem with `size` parameters.
template <int size>
struct NormalEquations {
  Eigen::Matrix<double, size, size> information = Eigen::Matrix<double, size, size>::Zero();
  Eigen::Matrix<double, size, 1> gradient = Eigen::Matrix<double, size, 1>::Zero();

  Eigen::Matrix<double, size, 1> Step(double damping) const {
    Eigen::Matrix<double, size, size> damped = information;
    damped.diagonal() *= 1 + damping;
    damped.diagonal().array() += 1e-12 * damped.trace();
    return -damped.ldlt().solve(gradient);
  }
};

// Levenberg-Marquardt for any model: linearize(model) returns NormalEquations, cost(model) the loss, and
// apply(model, step) the model after the step.
template <class Model, class Linearize, class Cost, class Apply>
Model Minimize(const Model& start, int max_iterations, const Linearize& linearize, const Cost& cost,
               const Apply& apply) {
  Model best = start;
  double best_cost = cost(start);
  double damping = 1e-4;
  auto equations = linearize(best);
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    const auto step = equations.Step(damping);
    if (!step.allFinite()) break;
    const Model candidate = apply(best, step);
    const double candidate_cost = cost(candidate);
    if (candidate_cost < best_cost) {
      const bool converged = best_cost - candidate_cost < 1e-6 * best_cost;
      best = candidate;
      best_cost = candidate_cost;
      if (converged) break;
      damping = std::max(damping * 0.1, 1e-9);
      equations = linearize(best);
    } else {
      damping *= 30;
      if (damping > 1e6) break;
    }
  }
  return best;
}

// The denominator is held fixed: near the solution the numerator is small, so its change dominates.
NormalEquations<5> LinearizePose(const RayPairs& pairs, const Weights& weights, const Rigid3& pose,
                                 double huber_px) {
  NormalEquations<5> equations;
  const Eigen::Matrix3d rotation = pose.rotation.matrix();
  const Eigen::Vector3d& translation = pose.translation;
  const Eigen::Matrix<double, 3, 2> basis = TangentBasis(translation);
  const double per_pixel_squared = 1 / (pairs.pixel_angle * pairs.pixel_angle);
  for (Eigen::Index i = 0; i < pairs.size(); ++i) {
    if (weights[i] == 0) continue;
    const Eigen::Vector3d rotated = rotation * pairs.RayA(i), ray_b = pairs.RayB(i);
    const Eigen::Vector3d plane_a = translation.cross(rotated), plane_b = ray_b.cross(translation);
    const double weight_of_angle =
        per_pixel_squared / (plane_a.squaredNorm() + plane_b.squaredNorm() + 1e-18);
    const double numerator = ray_b.dot(plane_a);
    Eigen::Matrix<double, 5, 1> jacobian;
    jacobian << rotated.cross(plane_b), basis.transpose() * rotated.cross(ray_b);
    const double weight =
        weights[i] * weight_of_angle * HuberSlope(numerator * numerator * weight_of_angle, huber_px);
    equations.information.noalias() += weight * jacobian * jacobian.transpose();
    equations.gradient += weight * numerator * jacobian;
  }
  return equations;
}

NormalEquations<9> LinearizeHomography(const RayPairs& pairs, const Weights& weights,
                                       const Eigen::Matrix3d& homography, double huber_px) {
  NormalEquations<9> equations;
  // Half of the squared one-way transfer error: the first-order joint distance if H is nearly a rotation.
  const double per_pixel_squared = 0.5 / (pairs.pixel_angle * pairs.pixel_angle);
  for (Eigen::Index i = 0; i < pairs.size(); ++i) {
    if (weights[i] == 0) continue;
    const Eigen::Vector3d ray_a = pairs.RayA(i), ray_b = pairs.RayB(i);
    const Eigen::Vector3d mapped = homography * ray_a;
    const double length = mapped.norm();
    if (!(length > 1e-12)) continue;
    const Eigen::Vector3d unit = mapped / length;
    const Eigen::Vector3d residual = unit - ray_b;
    const Eigen::Matrix3d slope = (Eigen::Matrix3d::Identity() - unit * unit.transpose()) / length;
    const double weight =
        weights[i] * per_pixel_squared * HuberSlope(residual.squaredNorm() * per_pixel_squared, huber_px);
    // Parameters column by column: d mapped / d (column j) = ray_a[j] * identity, and slope' slope = slope /
    // length.
    const Eigen::Matrix3d block = weight / length * slope;
    const Eigen::Vector3d pixel_gradient = weight * slope * residual;
    for (int j = 0; j < 3; ++j) {
      equations.gradient.segment<3>(3 * j) += ray_a[j] * pixel_gradient;
      for (int k = j; k < 3; ++k)
        equations.information.block<3, 3>(3 * j, 3 * k) += ray_a[j] * ray_a[k] * block;
    }
  }
  equations.information.template triangularView<Eigen::StrictlyLower>() = equations.information.transpose();
  return equations;
}

}  // namespace

RayPairs MakeRayPairs(std::span<const Eigen::Vector3d> rays_in_a, std::span<const Eigen::Vector3d> rays_in_b,
                      double pixel_angle) {
  RayPairs pairs;
  pairs.pixel_angle = pixel_angle;
  const auto count = static_cast<Eigen::Index>(std::min(rays_in_a.size(), rays_in_b.size()));
  pairs.a.resize(count, 3);
  pairs.b.resize(count, 3);
  for (Eigen::Index i = 0; i < count; ++i) {
    pairs.a.row(i) = rays_in_a[static_cast<std::size_t>(i)].transpose().array();
    pairs.b.row(i) = rays_in_b[static_cast<std::size_t>(i)].transpose().array();
  }
  return pairs;
}

Eigen::ArrayXd EssentialResiduals(const RayPairs& pairs, const Eigen::Matrix3d& essential) {
  const Columns lines_b = MapRays(essential, pairs.a);
  const Columns lines_a = MapRays(essential.transpose(), pairs.b);
  const Eigen::ArrayXd numerator = Dot(lines_b, pairs.b);
  // Only the component of the epipolar line's normal that is perpendicular to the ray affects the residual.
  const Eigen::ArrayXd squared = numerator.square();
  const Eigen::ArrayXd denominator = Dot(lines_a, lines_a) + Dot(lines_b, lines_b) - 2 * squared;
  return squared / (denominator.max(1e-18) * (pairs.pixel_angle * pairs.pixel_angle));
}

Eigen::ArrayXd HomographyResiduals(const RayPairs& pairs, const Eigen::Matrix3d& b_from_a) {
  const double scale = 0.25 / (pairs.pixel_angle * pairs.pixel_angle);
  const Eigen::Matrix3d a_from_b = b_from_a.inverse();
  if (!a_from_b.allFinite()) return Eigen::ArrayXd::Constant(pairs.size(), 16 * scale);
  return scale * (SquaredChord(MapRays(b_from_a, pairs.a), pairs.b) +
                  SquaredChord(MapRays(a_from_b, pairs.b), pairs.a));
}

Eigen::ArrayXd RotationResiduals(const RayPairs& pairs, const Eigen::Matrix3d& b_from_a) {
  const Columns difference = MapRays(b_from_a, pairs.a) - pairs.b;
  return Dot(difference, difference) * (0.5 / (pairs.pixel_angle * pairs.pixel_angle));
}

Rigid3 RefinePose(const RayPairs& pairs, const Weights& weights, const Rigid3& start, double huber_px,
                  int max_iterations) {
  return Minimize(
      start, max_iterations,
      [&](const Rigid3& pose) { return LinearizePose(pairs, weights, pose, huber_px); },
      [&](const Rigid3& pose) {
        return HuberLoss(EssentialResiduals(pairs, EssentialFromPose(pose)), weights, huber_px);
      },
      [](const Rigid3& pose, const Eigen::Matrix<double, 5, 1>& step) {
        const Eigen::Vector3d translation =
            pose.translation + TangentBasis(pose.translation) * step.tail<2>();
        return Rigid3{Rotation3::Exp(step.head<3>()) * pose.rotation, translation.normalized()};
      });
}

Eigen::Matrix3d RefineHomography(const RayPairs& pairs, const Weights& weights, const Eigen::Matrix3d& start,
                                 double huber_px, int max_iterations) {
  const Eigen::Matrix3d unit = start * (std::sqrt(3.0) / start.norm());
  return Minimize(
      unit, max_iterations,
      [&](const Eigen::Matrix3d& homography) {
        return LinearizeHomography(pairs, weights, homography, huber_px);
      },
      [&](const Eigen::Matrix3d& homography) {
        return HuberLoss(HomographyResiduals(pairs, homography), weights, huber_px);
      },
      [](const Eigen::Matrix3d& homography, const Eigen::Matrix<double, 9, 1>& step) -> Eigen::Matrix3d {
        const Eigen::Matrix3d moved = homography + Eigen::Map<const Eigen::Matrix3d>(step.data());
        return moved * (std::sqrt(3.0) / moved.norm());
      });
}

Eigen::Matrix3d FitRotation(const RayPairs& pairs, const Weights& weights) {
  Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
  for (Eigen::Index i = 0; i < pairs.size(); ++i)
    if (weights[i] != 0) correlation.noalias() += weights[i] * pairs.RayB(i) * pairs.RayA(i).transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, 1);
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) signs[2] = -1;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace docent::engine

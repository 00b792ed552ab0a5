// SPDX-License-Identifier: Apache-2.0
#include "engine/recognition/absolute_pose.h"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "engine/base/option_check.h"
#include "engine/base/random.h"

namespace docent::engine {
namespace {

// Coefficients, constant term first.
template <std::size_t m, std::size_t n>
std::array<double, m + n - 1> Multiply(const std::array<double, m>& a, const std::array<double, n>& b) {
  std::array<double, m + n - 1> product{};
  for (std::size_t i = 0; i < m; ++i)
    for (std::size_t j = 0; j < n; ++j) product[i + j] += a[i] * b[j];
  return product;
}

// Real roots of a quartic, including nearly double ones: the real parts of all roots with a small imaginary
// part. The caller refines and checks them.
std::vector<double> NearlyRealRoots(const std::array<double, 5>& coefficients) {
  const double largest =
      std::abs(*std::max_element(coefficients.begin(), coefficients.end(),
                                 [](double a, double b) { return std::abs(a) < std::abs(b); }));
  int degree = 4;
  while (degree > 0 && !(std::abs(coefficients[static_cast<std::size_t>(degree)]) > 1e-12 * largest))
    --degree;
  if (degree == 0) return {};
  Eigen::MatrixXd companion = Eigen::MatrixXd::Zero(degree, degree);
  for (int i = 0; i < degree; ++i) {
    if (i > 0) companion(i, i - 1) = 1;
    companion(i, degree - 1) =
        -coefficients[static_cast<std::size_t>(i)] / coefficients[static_cast<std::size_t>(degree)];
  }
  const Eigen::EigenSolver<Eigen::MatrixXd> eigen(companion, false);
  if (eigen.info() != Eigen::Success) return {};
  std::vector<double> roots;
  for (int i = 0; i < degree; ++i) {
    const auto root = eigen.eigenvalues()[i];
    if (std::abs(root.imag()) < 1e-4 * (1 + std::abs(root.real()))) roots.push_back(root.real());
  }
  return roots;
}

// The triangle of the points and the angles between the rays.
struct Triangle {
  double cosine01 = 0, cosine02 = 0, cosine12 = 0;
  double side01 = 0, side02 = 0, side12 = 0;  // squared

  // Residual of the law of cosines on each side.
  Eigen::Vector3d Residuals(const Eigen::Vector3d& s) const {
    return {s[0] * s[0] + s[1] * s[1] - 2 * s[0] * s[1] * cosine01 - side01,
            s[0] * s[0] + s[2] * s[2] - 2 * s[0] * s[2] * cosine02 - side02,
            s[1] * s[1] + s[2] * s[2] - 2 * s[1] * s[2] * cosine12 - side12};
  }
  Eigen::Matrix3d Jacobian(const Eigen::Vector3d& s) const {
    Eigen::Matrix3d jacobian;
    jacobian << 2 * (s[0] - s[1] * cosine01), 2 * (s[1] - s[0] * cosine01), 0,  //
        2 * (s[0] - s[2] * cosine02), 0, 2 * (s[2] - s[0] * cosine02),          //
        0, 2 * (s[1] - s[2] * cosine12), 2 * (s[2] - s[1] * cosine12);
    return jacobian;
  }
};

// Newton's method on the distances; empty if it does not converge.
std::optional<Eigen::Vector3d> Polish(const Triangle& triangle, Eigen::Vector3d distances) {
  constexpr int kIterations = 8;
  const double scale = std::max({triangle.side01, triangle.side02, triangle.side12});
  for (int i = 0; i < kIterations; ++i) {
    const Eigen::Vector3d residuals = triangle.Residuals(distances);
    if (residuals.cwiseAbs().maxCoeff() < 1e-13 * scale) break;
    const Eigen::Vector3d step = triangle.Jacobian(distances).fullPivLu().solve(residuals);
    if (!step.allFinite()) return std::nullopt;
    distances -= step;
  }
  if (!(distances.minCoeff() > 0) || !(triangle.Residuals(distances).cwiseAbs().maxCoeff() < 1e-7 * scale))
    return std::nullopt;
  return distances;
}

// All distances along the rays, from the ratios u = s1 / s0 and v = s2 / s0. The difference of the equations
// of two sides gives u as a quotient p(v) / q(v); inserted into the first equation, this gives a quartic in
// v.
std::vector<Eigen::Vector3d> SolveDistances(const Triangle& t) {
  const double k = (t.side12 - t.side01) / t.side02, m = t.side01 / t.side02;
  const std::array<double, 3> p = {k + 1, -2 * k * t.cosine02, k - 1};
  const std::array<double, 2> q = {2 * t.cosine01, -2 * t.cosine12};
  const std::array<double, 3> third = {1, -2 * t.cosine02, 1};  // (side 02 / s0)^2
  const auto q_squared = Multiply(q, q);
  const auto p_times_q_padded = Multiply(p, std::array<double, 3>{q[0], q[1], 0});
  const auto p_squared = Multiply(p, p), third_q_squared = Multiply(third, q_squared);
  std::array<double, 5> quartic{};
  for (std::size_t i = 0; i < 5; ++i)
    quartic[i] = (i < 3 ? q_squared[i] : 0) + p_squared[i] - 2 * t.cosine01 * p_times_q_padded[i] -
                 m * third_q_squared[i];

  std::vector<Eigen::Vector3d> solutions;
  const auto add = [&](double u, double v) {
    const double third_squared = third[0] + v * (third[1] + v * third[2]);
    if (!(u > 0 && v > 0 && third_squared > 0)) return;
    const double first = std::sqrt(t.side02 / third_squared);
    const auto polished = Polish(t, {first, u * first, v * first});
    if (!polished) return;
    for (const Eigen::Vector3d& known : solutions)
      if ((known - *polished).norm() < 1e-6 * polished->norm()) return;
    solutions.push_back(*polished);
  };
  for (const double v : NearlyRealRoots(quartic)) {
    const double denominator = q[0] + q[1] * v;
    if (std::abs(denominator) > 1e-5) add((p[0] + v * (p[1] + v * p[2])) / denominator, v);
    // If numerator and denominator vanish together (symmetric views), the first side alone gives two values
    // of u.
    if (std::abs(denominator) < 1e-3) {
      const double constant = 1 - m * (third[0] + v * (third[1] + v * third[2]));
      const double root = std::sqrt(std::max(t.cosine01 * t.cosine01 - constant, 0.0));
      add(t.cosine01 + root, v);
      add(t.cosine01 - root, v);
    }
  }
  return solutions;
}

// An orthonormal frame defined by a triangle; empty if the triangle is a line.
std::optional<Eigen::Matrix3d> TriangleFrame(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                             const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, normal = ab.cross(ac);
  if (!(normal.norm() > 1e-9 * ab.norm() * ac.norm())) return std::nullopt;
  Eigen::Matrix3d frame;
  frame.col(0) = ab.normalized();
  frame.col(2) = normal.normalized();
  frame.col(1) = frame.col(2).cross(frame.col(0));
  return frame;
}

struct Correspondences {
  std::vector<Eigen::Vector3d> rays, points;
  std::vector<std::size_t> index;  // in the caller's vectors
  double pixel_angle = 1;

  // Squared chord between ray and direction to the point, in pixels; large too if the point is behind the
  // camera.
  double Squared(std::size_t i, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation) const {
    const Eigen::Vector3d x = rotation * points[i] + translation;
    const double length = x.norm();
    if (!(length > 1e-12)) return std::numeric_limits<double>::infinity();
    return (x / length - rays[i]).squaredNorm() / (pixel_angle * pixel_angle);
  }
};

struct Support {
  Rigid3 pose;
  double cost = std::numeric_limits<double>::infinity();  // truncated squares
  std::vector<bool> inlier;
  int inliers = 0;
  double sum_of_squares = 0;  // of the inliers
};

Support EvaluateSupport(const Correspondences& all, const Rigid3& pose, double inlier_px) {
  Support support;
  support.pose = pose;
  support.cost = 0;
  support.inlier.assign(all.rays.size(), false);
  const Eigen::Matrix3d rotation = pose.rotation.matrix();
  const double limit = inlier_px * inlier_px;
  for (std::size_t i = 0; i < all.rays.size(); ++i) {
    const double squared = all.Squared(i, rotation, pose.translation);
    if (squared < limit) {
      support.inlier[i] = true;
      ++support.inliers;
      support.sum_of_squares += squared;
      support.cost += squared;
    } else {
      support.cost += limit;
    }
  }
  return support;
}

Support OptimizeLocally(const Correspondences& all, Support best, double inlier_px, int rounds) {
  for (int round = 0; round < rounds && best.inliers >= 4; ++round) {
    const Rigid3 pose =
        RefineAbsolutePose(all.rays, all.points, best.inlier, best.pose, all.pixel_angle, inlier_px / 2, 5);
    Support improved = EvaluateSupport(all, pose, inlier_px);
    if (!(improved.cost < best.cost)) break;
    best = std::move(improved);
  }
  return best;
}

int IterationsNeeded(int inliers, std::size_t total, double confidence, int limit) {
  const double clean = std::pow(static_cast<double>(inliers) / static_cast<double>(total), 3);
  if (clean >= 1) return 1;
  if (!(clean > 1e-9)) return limit;
  return static_cast<int>(std::min<double>(limit, std::ceil(std::log(1 - confidence) / std::log1p(-clean))));
}

Support FindSupport(const Correspondences& all, const AbsolutePoseOptions& options) {
  Random random(options.seed);
  Support best;
  const auto total = static_cast<std::uint32_t>(all.rays.size());
  int needed = options.max_iterations;
  constexpr int kMinIterations = 5;
  for (int iteration = 0; iteration < needed; ++iteration) {
    std::array<std::uint32_t, 3> sample{};
    sample[0] = random.Below(total);
    do sample[1] = random.Below(total);
    while (sample[1] == sample[0]);
    do sample[2] = random.Below(total);
    while (sample[2] == sample[0] || sample[2] == sample[1]);
    const std::array<Eigen::Vector3d, 3> rays = {all.rays[sample[0]], all.rays[sample[1]],
                                                 all.rays[sample[2]]};
    const std::array<Eigen::Vector3d, 3> points = {all.points[sample[0]], all.points[sample[1]],
                                                   all.points[sample[2]]};
    Support best_of_sample;
    for (const Rigid3& pose : SolveThreePoints(rays, points)) {
      Support support = EvaluateSupport(all, pose, options.inlier_px);
      if (support.cost < best_of_sample.cost) best_of_sample = std::move(support);
    }
    if (!(best_of_sample.cost < best.cost)) continue;
    best = OptimizeLocally(all, std::move(best_of_sample), options.inlier_px, 2);
    needed = std::min(
        needed, std::max(kMinIterations,
                         IterationsNeeded(best.inliers, total, options.confidence, options.max_iterations)));
  }
  return best;
}

}  // namespace

std::optional<std::string> AbsolutePoseOptions::Validate() const {
  return OptionCheck()
      .Positive(pixel_angle, "angle of a pixel")
      .Positive(inlier_px, "inlier threshold of an absolute pose")
      .AtLeast(max_iterations, 1, "number of iterations of an absolute pose")
      .Ratio(confidence, "confidence of an absolute pose")
      .AtLeast(min_inliers, 0, "number of inliers of an absolute pose")
      .Ratio(min_inlier_ratio, "inlier ratio of an absolute pose")
      .fault();
}

std::vector<Rigid3> SolveThreePoints(std::span<const Eigen::Vector3d, 3> rays_in_camera,
                                     std::span<const Eigen::Vector3d, 3> points_in_map) {
  const auto map_frame = TriangleFrame(points_in_map[0], points_in_map[1], points_in_map[2]);
  if (!map_frame) return {};
  Triangle triangle;
  triangle.cosine01 = rays_in_camera[0].dot(rays_in_camera[1]);
  triangle.cosine02 = rays_in_camera[0].dot(rays_in_camera[2]);
  triangle.cosine12 = rays_in_camera[1].dot(rays_in_camera[2]);
  if (std::max({triangle.cosine01, triangle.cosine02, triangle.cosine12}) > 1 - 1e-12) return {};
  triangle.side01 = (points_in_map[0] - points_in_map[1]).squaredNorm();
  triangle.side02 = (points_in_map[0] - points_in_map[2]).squaredNorm();
  triangle.side12 = (points_in_map[1] - points_in_map[2]).squaredNorm();

  std::vector<Rigid3> poses;
  for (const Eigen::Vector3d& distances : SolveDistances(triangle)) {
    const Eigen::Vector3d corner = distances[0] * rays_in_camera[0];
    const auto camera_frame =
        TriangleFrame(corner, distances[1] * rays_in_camera[1], distances[2] * rays_in_camera[2]);
    if (!camera_frame) continue;
    const Rotation3 rotation(Eigen::Matrix3d(*camera_frame * map_frame->transpose()));
    poses.push_back({rotation, corner - rotation * points_in_map[0]});
  }
  return poses;
}

Rigid3 RefineAbsolutePose(std::span<const Eigen::Vector3d> rays_in_camera,
                          std::span<const Eigen::Vector3d> points_in_map, const std::vector<bool>& use,
                          const Rigid3& start, double pixel_angle, double huber_px, int max_iterations) {
  const double per_pixel = 1 / pixel_angle;
  // Residual: direction to the point minus ray, in pixels. With `information` also the normal equations of a
  // twist on the left.
  const auto evaluate = [&](const Rigid3& pose, Eigen::Matrix<double, 6, 6>* information,
                            Eigen::Matrix<double, 6, 1>* gradient) {
    double cost = 0;
    const Eigen::Matrix3d rotation = pose.rotation.matrix();
    for (std::size_t i = 0; i < rays_in_camera.size(); ++i) {
      if (!use.empty() && !use[i]) continue;
      const Eigen::Vector3d x = rotation * points_in_map[i] + pose.translation;
      const double length = x.norm();
      if (!(length > 1e-12)) return std::numeric_limits<double>::infinity();
      const Eigen::Vector3d direction = x / length;
      const Eigen::Vector3d residual = per_pixel * (direction - rays_in_camera[i]);
      const double norm = residual.norm();
      cost += norm <= huber_px ? norm * norm : huber_px * (2 * norm - huber_px);
      if (!information) continue;
      const double weight = norm <= huber_px ? 1.0 : huber_px / norm;
      const Eigen::Matrix3d slope =
          (per_pixel / length) * (Eigen::Matrix3d::Identity() - direction * direction.transpose());
      Eigen::Matrix<double, 3, 6> jacobian;
      jacobian << slope, slope * -Hat(x);
      information->noalias() += weight * jacobian.transpose() * jacobian;
      gradient->noalias() += weight * jacobian.transpose() * residual;
    }
    return cost;
  };

  Rigid3 best = start;
  double damping = 1e-4;
  Eigen::Matrix<double, 6, 6> information = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> gradient = Eigen::Matrix<double, 6, 1>::Zero();
  double best_cost = evaluate(best, &information, &gradient);
  for (int iteration = 0; iteration < max_iterations && std::isfinite(best_cost); ++iteration) {
    Eigen::Matrix<double, 6, 6> damped = information;
    damped.diagonal() *= 1 + damping;
    damped.diagonal().array() += 1e-12 * information.trace();
    const Eigen::Matrix<double, 6, 1> step = -damped.ldlt().solve(gradient);
    if (!step.allFinite()) break;
    const Rigid3 candidate = Rigid3::Exp(step) * best;
    const double cost = evaluate(candidate, nullptr, nullptr);
    if (cost < best_cost) {
      const bool settled = best_cost - cost < 1e-9 * best_cost;
      best = candidate;
      if (settled) break;
      damping = std::max(damping * 0.1, 1e-9);
      information.setZero();
      gradient.setZero();
      best_cost = evaluate(best, &information, &gradient);
    } else {
      damping *= 30;
      if (damping > 1e6) break;
    }
  }
  return best;
}

std::optional<AbsolutePose> EstimateAbsolutePose(std::span<const Eigen::Vector3d> rays_in_camera,
                                                 std::span<const Eigen::Vector3d> points_in_map,
                                                 const AbsolutePoseOptions& options) {
  Checked(options);
  const std::size_t count = std::min(rays_in_camera.size(), points_in_map.size());
  Correspondences all;
  all.pixel_angle = options.pixel_angle;
  for (std::size_t i = 0; i < count; ++i) {
    if (!(std::abs(rays_in_camera[i].squaredNorm() - 1) < 1e-6) || !points_in_map[i].allFinite()) continue;
    all.rays.push_back(rays_in_camera[i]);
    all.points.push_back(points_in_map[i]);
    all.index.push_back(i);
  }
  const int min_inliers = std::max(
      {options.min_inliers, 4,
       static_cast<int>(std::ceil(options.min_inlier_ratio * static_cast<double>(all.rays.size())))});
  if (static_cast<int>(all.rays.size()) < min_inliers) return std::nullopt;
  constexpr int kFinalRounds = 5;
  const Support best = OptimizeLocally(all, FindSupport(all, options), options.inlier_px, kFinalRounds);
  if (best.inliers < min_inliers) return std::nullopt;

  AbsolutePose result;
  result.camera_from_map = best.pose;
  result.inlier_count = best.inliers;
  result.rms_px = std::sqrt(best.sum_of_squares / best.inliers);
  result.inlier.assign(count, false);
  for (std::size_t i = 0; i < all.index.size(); ++i) result.inlier[all.index[i]] = best.inlier[i];
  return result;
}

}  // namespace docent::engine

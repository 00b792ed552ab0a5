// SPDX-License-Identifier: Apache-2.0
#include "engine/geometry/sim3.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <ostream>

namespace docent::engine {
namespace {

// A cloud counts as a line if its second largest spread is below this ratio of its largest.
constexpr double kLineRatio = 1e-6;

Eigen::Vector3d Mean(std::span<const Eigen::Vector3d> points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) {
    sum += point;
  }
  return sum / static_cast<double>(points.size());
}

// Whether all points lie on one line through their mean. Compares distances instead of squared distances: a
// scatter matrix would lose half of the digits.
bool IsLine(std::span<const Eigen::Vector3d> points, const Eigen::Vector3d& mean) {
  const auto farthest = std::max_element(points.begin(), points.end(), [&](const auto& a, const auto& b) {
    return (a - mean).squaredNorm() < (b - mean).squaredNorm();
  });
  const double length = (*farthest - mean).norm();
  if (!(length > 0)) {
    return true;
  }
  const Eigen::Vector3d direction = (*farthest - mean) / length;
  double off_line = 0;
  for (const Eigen::Vector3d& point : points) {
    off_line = std::max(off_line, direction.cross(point - mean).norm());
  }
  return off_line < kLineRatio * length;
}

}  // namespace

Sim3 Sim3::inverse() const {
  Sim3 result;
  result.scale = 1.0 / scale;
  result.rotation = rotation.inverse();
  result.translation = -(result.scale * (result.rotation * translation));
  return result;
}

Sim3 Sim3::operator*(const Sim3& other) const {
  Sim3 result;
  result.scale = scale * other.scale;
  result.rotation = rotation * other.rotation;
  result.translation = *this * other.translation;
  return result;
}

std::optional<Sim3> AlignSim3(std::span<const Eigen::Vector3d> points_in_a,
                              std::span<const Eigen::Vector3d> points_in_b, bool fixed_scale) {
  if (points_in_a.size() != points_in_b.size() || points_in_a.size() < 3) {
    return std::nullopt;
  }
  const Eigen::Vector3d mean_a = Mean(points_in_a);
  const Eigen::Vector3d mean_b = Mean(points_in_b);
  if (!mean_a.allFinite() || !mean_b.allFinite() || IsLine(points_in_a, mean_a) ||
      IsLine(points_in_b, mean_b)) {
    return std::nullopt;
  }
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double variance_b = 0;
  for (std::size_t i = 0; i < points_in_a.size(); ++i) {
    const Eigen::Vector3d b = points_in_b[i] - mean_b;
    covariance += (points_in_a[i] - mean_a) * b.transpose();
    variance_b += b.squaredNorm();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& singular = svd.singularValues();
  // The clouds may have an extent each and still be uncorrelated: then no rotation is best.
  if (!(singular[1] > kLineRatio * kLineRatio * singular[0])) {
    return std::nullopt;
  }
  Eigen::Vector3d sign = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) {
    // The best orthogonal matrix is a reflection; the axis with the smallest singular value is inverted.
    sign[2] = -1;
  }
  Sim3 result;
  result.rotation = Rotation3(Eigen::Matrix3d(svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose()));
  result.scale = fixed_scale ? 1.0 : singular.dot(sign) / variance_b;
  if (!(result.scale > 0) || !std::isfinite(result.scale)) {
    return std::nullopt;
  }
  result.translation = mean_a - result.scale * (result.rotation * mean_b);
  return result;
}

std::ostream& operator<<(std::ostream& out, const Sim3& transform) {
  return out << "scale " << transform.scale << ", translation " << transform.translation.transpose() << ", "
             << transform.rotation;
}

}  // namespace docent::engine

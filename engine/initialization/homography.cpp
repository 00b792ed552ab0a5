// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/homography.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace docent::engine {

std::optional<Eigen::Matrix3d> SolveFourPoint(std::span<const Eigen::Vector3d, 4> rays_in_a,
                                              std::span<const Eigen::Vector3d, 4> rays_in_b) {
  // With the first three rays as a basis, the coordinates of the fourth determine the scale of each ray.
  Eigen::Matrix3d basis_a, basis_b;
  basis_a << rays_in_a[0], rays_in_a[1], rays_in_a[2];
  basis_b << rays_in_b[0], rays_in_b[1], rays_in_b[2];
  constexpr double kMinVolume = 1e-7;  // of unit rays: about a triangle 0.5 degrees across
  if (!(std::abs(basis_a.determinant()) > kMinVolume && std::abs(basis_b.determinant()) > kMinVolume))
    return std::nullopt;
  const Eigen::Matrix3d inverse_a = basis_a.inverse();
  const Eigen::Vector3d along_a = inverse_a * rays_in_a[3], along_b = basis_b.inverse() * rays_in_b[3];
  const Eigen::Vector3d scales = along_b.cwiseQuotient(along_a);
  // All four points must lie in front of both cameras, so every scale must be positive.
  if (!(scales.minCoeff() > 0) || !scales.allFinite()) return std::nullopt;
  return basis_b * scales.asDiagonal() * inverse_a;
}

std::optional<Eigen::Matrix3d> ScaleHomography(const Eigen::Matrix3d& homography) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(homography.transpose() * homography,
                                                             Eigen::EigenvaluesOnly);
  const double middle = eigen.eigenvalues()[1];
  if (!(middle > 1e-12 * eigen.eigenvalues()[2])) return std::nullopt;
  return homography / std::sqrt(middle);
}

std::vector<PlaneMotion> DecomposeHomography(const Eigen::Matrix3d& b_from_a) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(b_from_a.transpose() * b_from_a);
  // Eigenvalues with largest >= 1 >= smallest. Rounding may leave the middle one slightly off 1, so it serves
  // as the unit.
  const double middle = eigen.eigenvalues()[1];
  if (!(middle > 1e-12)) return {};
  const double largest = eigen.eigenvalues()[2] / middle, smallest = eigen.eigenvalues()[0] / middle;
  if (!(largest - smallest > 1e-9)) return {};
  const Eigen::Matrix3d homography = b_from_a / std::sqrt(middle);
  const Eigen::Vector3d v1 = eigen.eigenvectors().col(2), v2 = eigen.eigenvectors().col(1);
  const Eigen::Vector3d v3 = eigen.eigenvectors().col(0);
  const double along = std::sqrt(std::max(1 - smallest, 0.0)) / std::sqrt(largest - smallest);
  const double across = std::sqrt(std::max(largest - 1, 0.0)) / std::sqrt(largest - smallest);

  std::vector<PlaneMotion> motions;
  for (const double sign : {1.0, -1.0}) {
    // v2 and u span a plane on which H preserves all lengths; the rotation maps both in the same way.
    const Eigen::Vector3d u = along * v1 + sign * across * v3;
    Eigen::Matrix3d before, after;
    before << v2, u, v2.cross(u);
    const Eigen::Vector3d rotated_v2 = homography * v2, rotated_u = homography * u;
    after << rotated_v2, rotated_u, rotated_v2.cross(rotated_u);
    const Eigen::Matrix3d rotation_matrix = after * before.transpose();
    const Eigen::Vector3d normal = v2.cross(u);
    const Eigen::Vector3d translation = (homography - rotation_matrix) * normal;
    const Rotation3 rotation{rotation_matrix};
    motions.push_back({{rotation, translation}, normal});
    motions.push_back({{rotation, -translation}, -normal});
  }
  return motions;
}

}  // namespace docent::engine

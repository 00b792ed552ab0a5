// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace docent::engine {

// Two unit vectors, the columns, that are perpendicular to a unit vector and to each other.
inline Eigen::Matrix<double, 3, 2> TangentBasis(const Eigen::Vector3d& unit) {
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = unit.unitOrthogonal();
  basis.col(1) = unit.cross(basis.col(0));
  return basis;
}

}  // namespace docent::engine

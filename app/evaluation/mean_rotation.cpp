// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/mean_rotation.h"

#include <Eigen/SVD>

namespace docent::app {

engine::Rotation3 MeanRotation(const std::vector<engine::Rotation3>& rotations) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const engine::Rotation3& rotation : rotations) sum += rotation.matrix();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d mean = svd.matrixU() * svd.matrixV().transpose();
  if (mean.determinant() < 0) {
    mean = svd.matrixU() * Eigen::Vector3d(1, 1, -1).asDiagonal() * svd.matrixV().transpose();
  }
  return engine::Rotation3(mean);
}

}  // namespace docent::app

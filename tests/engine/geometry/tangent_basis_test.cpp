// SPDX-License-Identifier: Apache-2.0
#include "engine/geometry/tangent_basis.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/engine/geometry/test_math.h"

namespace docent::engine {
namespace {

std::vector<Eigen::Vector3d> UnitVectors() {
  std::vector<Eigen::Vector3d> units;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {1.0, -1.0}) {
      const Eigen::Vector3d unit = sign * Eigen::Vector3d::Unit(axis);
      units.push_back(unit);
      // Almost an axis, where a basis that is made from one fixed vector degenerates.
      units.push_back((unit + Eigen::Vector3d(1e-9, -2e-9, 3e-9)).normalized());
    }
  }
  Random random(1);
  for (int i = 0; i < 200; ++i) units.push_back(RandomDirection(&random));
  return units;
}

TEST(TangentBasis, IsOrthonormalAndPerpendicularToTheVector) {
  for (const Eigen::Vector3d& unit : UnitVectors()) {
    const Eigen::Matrix<double, 3, 2> basis = TangentBasis(unit);
    EXPECT_LT((basis.transpose() * basis - Eigen::Matrix2d::Identity()).norm(), 1e-14) << unit.transpose();
    EXPECT_LT((basis.transpose() * unit).norm(), 1e-14) << unit.transpose();
  }
}

// What it is for: a small step in the basis moves a direction by as much.
TEST(TangentBasis, SpansTheStepsOfADirection) {
  Random random(2);
  for (const Eigen::Vector3d& unit : UnitVectors()) {
    const Eigen::Vector2d step(random.Uniform(-1e-4, 1e-4), random.Uniform(-1e-4, 1e-4));
    const Eigen::Vector3d moved = (unit + TangentBasis(unit) * step).normalized();
    EXPECT_NEAR(AngleBetween(unit, moved), step.norm(), 1e-11);
  }
}

}  // namespace
}  // namespace docent::engine

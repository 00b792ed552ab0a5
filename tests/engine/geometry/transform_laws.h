// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "tests/engine/geometry/test_math.h"

// Checks of the group laws for a type of 3D transforms. `T` needs a default constructor (the identity),
// operator*, inverse() and an action on Eigen::Vector3d.
namespace docent::engine {

// The largest distance between the images of four points that span space.
template <typename T>
double Difference(const T& a, const T& b) {
  double worst = (a * Eigen::Vector3d(0, 0, 0) - b * Eigen::Vector3d(0, 0, 0)).norm();
  for (int axis = 0; axis < 3; ++axis) {
    worst = std::max(worst, (a * Eigen::Vector3d(Eigen::Vector3d::Unit(axis)) -
                             b * Eigen::Vector3d(Eigen::Vector3d::Unit(axis)))
                                .norm());
  }
  return worst;
}

template <typename T>
void ExpectGroupLaws(const std::vector<T>& samples, double tolerance) {
  ASSERT_GE(samples.size(), 3u);
  const T identity;
  const Eigen::Vector3d point(0.3, -1.7, 2.9);
  EXPECT_EQ(identity * point, point);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const T& a = samples[i];
    const T& b = samples[(i + 1) % samples.size()];
    const T& c = samples[(i + 2) % samples.size()];
    EXPECT_LT(Difference(a * identity, a), tolerance) << a;
    EXPECT_LT(Difference(identity * a, a), tolerance) << a;
    EXPECT_LT(Difference(a * a.inverse(), identity), tolerance) << a;
    EXPECT_LT(Difference(a.inverse() * a, identity), tolerance) << a;
    EXPECT_LT(Difference((a * b) * c, a * (b * c)), tolerance) << a << b << c;
    EXPECT_LT(Difference((a * b).inverse(), b.inverse() * a.inverse()), tolerance) << a << b;
    EXPECT_LT(((a * b) * point - a * (b * point)).norm(), tolerance) << a << b;
  }
}

// Angles in radians from far below the rounding error, across both sides of the switch to the power series,
// up to pi.
inline std::vector<double> CriticalAngles() {
  return {0,       1e-300, 1e-160,     1e-20,      1e-12,      1e-9,       1e-8, 1e-7,
          1e-5,    1e-3,   0.0999999,  0.1,        0.1000001,  0.5,        1.0,  2.0,
          kPi / 2, 3.0,    kPi - 1e-3, kPi - 1e-6, kPi - 1e-9, kPi - 1e-12};
}

}  // namespace docent::engine

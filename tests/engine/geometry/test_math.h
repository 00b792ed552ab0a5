// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <numbers>

#include "engine/base/random.h"
#include "engine/geometry/rigid3.h"

// Angles, random vectors and errors of poses, for all tests of the engine.
namespace docent::engine {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

inline constexpr double kPi = std::numbers::pi;

inline double Degrees(double radians) {
  return radians * 180 / kPi;
}
inline double Radians(double degrees) {
  return degrees * kPi / 180;
}

// A standard normal variable (Box and Muller 1958).
inline double RandomNormal(Random* random) {
  const double radius = std::sqrt(-2 * std::log(1 - random->Uniform()));
  return radius * std::cos(2 * kPi * random->Uniform());
}

// Two of them. They are drawn one after the other, because compilers evaluate the arguments of a call in
// different orders, and a scene must be the same with all of them.
inline Eigen::Vector2d RandomNormals(Random* random) {
  const double second = RandomNormal(random);
  const double first = RandomNormal(random);
  return {first, second};
}

// Each component is uniform in [-size, size).
inline Eigen::Vector3d RandomVector(Random* random, double size) {
  return {random->Uniform(-size, size), random->Uniform(-size, size), random->Uniform(-size, size)};
}

// Uniform on the unit sphere.
inline Eigen::Vector3d RandomDirection(Random* random) {
  const double x = RandomNormal(random), y = RandomNormal(random), z = RandomNormal(random);
  return Eigen::Vector3d(x, y, z).normalized();
}

// In radians, exact for small angles too. The vectors may have any length but zero.
inline double AngleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}
inline double AngleBetween(const Rotation3& a, const Rotation3& b) {
  return (a.inverse() * b).Angle();
}

inline double RotationErrorDeg(const Rigid3& estimate, const Rigid3& truth) {
  return Degrees(AngleBetween(estimate.rotation, truth.rotation));
}

}  // namespace docent::engine

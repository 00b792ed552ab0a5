// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "engine/base/multiply_add.h"

namespace docent::engine {

// Three numbers for functions that are called for every point of every image. Compilers keep them in
// registers, while an Eigen vector is stored number by number and then loaded as a whole, for which a
// processor waits a dozen cycles.
struct PlainVector3 {
  PlainVector3() = default;
  PlainVector3(double first, double second, double third) : x(first), y(second), z(third) {}
  explicit PlainVector3(const Eigen::Vector3d& v) : x(v.x()), y(v.y()), z(v.z()) {}

  friend PlainVector3 operator+(const PlainVector3& a, const PlainVector3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  friend PlainVector3 operator*(const PlainVector3& a, double b) { return {a.x * b, a.y * b, a.z * b}; }

  double x = 0, y = 0, z = 0;
};

inline PlainVector3 Cross(const PlainVector3& a, const PlainVector3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

inline double Dot(const PlainVector3& a, const PlainVector3& b) {
  return MultiplyAdd(a.z, b.z, MultiplyAdd(a.y, b.y, a.x * b.x));
}

}  // namespace docent::engine

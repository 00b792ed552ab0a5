// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <iosfwd>
#include <optional>
#include <span>

#include "engine/geometry/rigid3.h"

namespace docent::engine {

// A similarity (Sim(3)): x_in_a = scale * (rotation * x_in_b) + translation, scale > 0.
struct Sim3 {
  Rotation3 rotation;                                     // applied first
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  // applied last, length units of a
  double scale = 1.0;                                     // length units of a per length unit of b

  // For a_from_b: b_from_a.
  Sim3 inverse() const;
  // Transforms a point.
  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return scale * (rotation * x) + translation; }
  // a_from_b * b_from_c.
  Sim3 operator*(const Sim3& other) const;
};

// The rigid transform without the scale.
inline Sim3 AsSim3(const Rigid3& rigid) {
  return {rigid.rotation, rigid.translation, 1.0};
}

// The similarity a_from_b that minimizes sum |a_i - a_from_b * b_i|^2 (Umeyama 1991). Empty for fewer than
// three points and for collinear points. With fixed_scale the scale stays 1.
std::optional<Sim3> AlignSim3(std::span<const Eigen::Vector3d> points_in_a,
                              std::span<const Eigen::Vector3d> points_in_b, bool fixed_scale = false);

// For messages and tests.
std::ostream& operator<<(std::ostream& out, const Sim3& transform);

}  // namespace docent::engine

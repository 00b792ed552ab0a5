// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <iosfwd>

// Rotations and rigid transforms. A variable is named a_from_b and maps coordinates in b to coordinates in a:
// x_in_a = a_from_b * x_in_b, and c_from_a = c_from_b * b_from_a. Lengths in map units, angles in radians.
namespace docent::engine {

// [v]x, the matrix with Hat(v) * w = v.cross(w).
Eigen::Matrix3d Hat(const Eigen::Vector3d& v);

// A rotation of three-space (SO(3)), stored as a unit quaternion.
class Rotation3 {
 public:
  Rotation3() : quaternion_(Eigen::Quaterniond::Identity()) {}
  // Normalizes; the quaternion must not be zero.
  explicit Rotation3(const Eigen::Quaterniond& quaternion) : quaternion_(quaternion.normalized()) {}
  // The rotation nearest to the matrix, which must be orthonormal except for rounding.
  explicit Rotation3(const Eigen::Matrix3d& matrix) : quaternion_(Eigen::Quaterniond(matrix).normalized()) {}

  // Of a quaternion whose length is 1 but for rounding, which is kept to the bit: to normalize a unit
  // quaternion again can change its last bits.
  static Rotation3 FromUnit(const Eigen::Quaterniond& quaternion) {
    Rotation3 result;
    result.quaternion_ = quaternion;
    return result;
  }

  // Exponential map: the rotation by |rotation_vector| radians about its direction; accurate also near zero.
  static Rotation3 Exp(const Eigen::Vector3d& rotation_vector);
  // Inverse of Exp; the result's norm is at most pi.
  Eigen::Vector3d Log() const;

  const Eigen::Quaterniond& quaternion() const { return quaternion_; }       // unit length
  Eigen::Matrix3d matrix() const { return quaternion_.toRotationMatrix(); }  // orthonormal
  // For a_from_b: b_from_a.
  Rotation3 inverse() const { return FromUnit(quaternion_.conjugate()); }
  // Angle of the rotation, in [0, pi].
  double Angle() const { return Log().norm(); }

  // Rotates a vector.
  Eigen::Vector3d operator*(const Eigen::Vector3d& v) const { return quaternion_ * v; }
  // a_from_b * b_from_c.
  Rotation3 operator*(const Rotation3& other) const { return Rotation3(quaternion_ * other.quaternion_); }

 private:
  Eigen::Quaterniond quaternion_;
};

// A rigid transform (SE(3)): x_in_a = rotation * x_in_b + translation.
struct Rigid3 {
  Rotation3 rotation;                                     // applied first
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();  // length units of a

  Rigid3() = default;  // the identity
  // Rotates, then translates.
  Rigid3(const Rotation3& rotation_in, const Eigen::Vector3d& translation_in)
      : rotation(rotation_in), translation(translation_in) {}

  // Twist (v, w), translation part first, rotation part last: the standard exponential map of SE(3). Small
  // updates are applied on the left, camera_from_map = Exp(twist) * camera_from_map, so the twist is
  // expressed in the camera frame.
  static Rigid3 Exp(const Eigen::Matrix<double, 6, 1>& twist);
  // The inverse of Exp.
  Eigen::Matrix<double, 6, 1> Log() const;

  // For a_from_b: b_from_a.
  Rigid3 inverse() const {
    const Rotation3 inverse_rotation = rotation.inverse();
    return {inverse_rotation, -(inverse_rotation * translation)};
  }
  // For camera_from_map: the camera centre in the map, map units.
  Eigen::Vector3d OriginInSource() const { return -(rotation.inverse() * translation); }

  // Transforms a point.
  Eigen::Vector3d operator*(const Eigen::Vector3d& x) const { return rotation * x + translation; }
  // Homogeneous (X, w): w = 1 finite, w = 0 a direction.
  Eigen::Vector4d operator*(const Eigen::Vector4d& x) const {
    Eigen::Vector4d result;
    result << rotation * Eigen::Vector3d(x.head<3>()) + translation * x[3], x[3];
    return result;
  }
  // a_from_b * b_from_c.
  Rigid3 operator*(const Rigid3& other) const {
    return {rotation * other.rotation, rotation * other.translation + translation};
  }
};

// True if the transforms differ by at most these amounts (map units, radians).
bool IsNear(const Rigid3& a, const Rigid3& b, double translation_tolerance, double rotation_tolerance);
// For messages and tests.
std::ostream& operator<<(std::ostream& out, const Rotation3& rotation);
// For messages and tests.
std::ostream& operator<<(std::ostream& out, const Rigid3& transform);

}  // namespace docent::engine

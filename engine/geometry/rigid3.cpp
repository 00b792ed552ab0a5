// SPDX-License-Identifier: Apache-2.0
#include "engine/geometry/rigid3.h"

#include <cmath>
#include <ostream>

namespace docent::engine {

// Programs that use the installed package count on it; see DOCENT_EIGEN_LAYOUT in cmake/DocentTargets.cmake.
static_assert(EIGEN_MAX_ALIGN_BYTES == 32 && EIGEN_MAX_STATIC_ALIGN_BYTES == 32 &&
                  EIGEN_MALLOC_ALREADY_ALIGNED == 0,
              "types with Eigen members have the same layout in every build");
namespace {

// Below this squared angle the closed forms lose precision to cancellation, and the series of four terms are
// exact to rounding.
constexpr double kSeriesAngleSquared = 0.01;

// (1 - cos t) / t^2.
double OneMinusCosineOverSquare(double squared) {
  if (squared < kSeriesAngleSquared) {
    return 1.0 / 2 - squared * (1.0 / 24 - squared * (1.0 / 720 - squared * (1.0 / 40320)));
  }
  const double sine = std::sin(std::sqrt(squared) / 2);
  return 2 * sine * sine / squared;
}

// (t - sin t) / t^3.
double AngleMinusSineOverCube(double squared) {
  if (squared < kSeriesAngleSquared) {
    return 1.0 / 6 - squared * (1.0 / 120 - squared * (1.0 / 5040 - squared * (1.0 / 362880)));
  }
  const double angle = std::sqrt(squared);
  return (angle - std::sin(angle)) / (squared * angle);
}

// (1 - (t / 2) cot(t / 2)) / t^2, the quadratic coefficient of the inverse of SE(3)'s V matrix.
double InverseCoefficient(double squared) {
  if (squared < kSeriesAngleSquared) {
    return 1.0 / 12 + squared * (1.0 / 720 + squared * (1.0 / 30240 + squared * (1.0 / 1209600)));
  }
  const double half = std::sqrt(squared) / 2;
  return (1.0 - half * std::cos(half) / std::sin(half)) / squared;
}

}  // namespace

Eigen::Matrix3d Hat(const Eigen::Vector3d& v) {
  Eigen::Matrix3d result;
  result << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return result;
}

Rotation3 Rotation3::Exp(const Eigen::Vector3d& rotation_vector) {
  const double squared = rotation_vector.squaredNorm();
  double cosine, sine_over_angle;  // of half the angle
  if (squared < kSeriesAngleSquared) {
    const double quarter = squared / 4;
    sine_over_angle = 0.5 * (1 - quarter * (1.0 / 6 - quarter * (1.0 / 120 - quarter * (1.0 / 5040))));
    cosine = 1 - quarter * (1.0 / 2 - quarter * (1.0 / 24 - quarter * (1.0 / 720)));
  } else {
    const double angle = std::sqrt(squared);
    sine_over_angle = std::sin(angle / 2) / angle;
    cosine = std::cos(angle / 2);
  }
  const Eigen::Vector3d imaginary = sine_over_angle * rotation_vector;
  return FromUnit(Eigen::Quaterniond(cosine, imaginary.x(), imaginary.y(), imaginary.z()));
}

Eigen::Vector3d Rotation3::Log() const {
  // Of the two quaternions of a rotation, the one with a non-negative real part has an angle of at most pi.
  const double sign = quaternion_.w() < 0 ? -1.0 : 1.0;
  const Eigen::Vector3d imaginary = sign * quaternion_.vec();
  const double real = sign * quaternion_.w();
  const double norm = imaginary.norm();
  if (norm < 1e-8) {
    return (2.0 / real) * imaginary;
  }
  return (2.0 * std::atan2(norm, real) / norm) * imaginary;
}

Rigid3 Rigid3::Exp(const Eigen::Matrix<double, 6, 1>& twist) {
  const Eigen::Vector3d v = twist.head<3>();
  const Eigen::Vector3d w = twist.tail<3>();
  const double squared = w.squaredNorm();
  const Eigen::Vector3d w_cross_v = w.cross(v);
  return {Rotation3::Exp(w), v + OneMinusCosineOverSquare(squared) * w_cross_v +
                                 AngleMinusSineOverCube(squared) * w.cross(w_cross_v)};
}

Eigen::Matrix<double, 6, 1> Rigid3::Log() const {
  const Eigen::Vector3d w = rotation.Log();
  const Eigen::Vector3d w_cross_t = w.cross(translation);
  Eigen::Matrix<double, 6, 1> twist;
  twist << translation - 0.5 * w_cross_t + InverseCoefficient(w.squaredNorm()) * w.cross(w_cross_t), w;
  return twist;
}

bool IsNear(const Rigid3& a, const Rigid3& b, double translation_tolerance, double rotation_tolerance) {
  return (a.translation - b.translation).norm() <= translation_tolerance &&
         (a.rotation.inverse() * b.rotation).Angle() <= rotation_tolerance;
}

std::ostream& operator<<(std::ostream& out, const Rotation3& rotation) {
  const Eigen::Quaterniond& q = rotation.quaternion();
  return out << "rotation (qx qy qz qw) " << q.x() << ' ' << q.y() << ' ' << q.z() << ' ' << q.w();
}

std::ostream& operator<<(std::ostream& out, const Rigid3& transform) {
  return out << "translation " << transform.translation.transpose() << ", " << transform.rotation;
}

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <optional>

// The distortion of the lens models of CameraModel. k: their coefficients, as in CameraModel::distortion.
// Lengths are in focal lengths, angles in radians from the optical axis.
namespace docent::engine {

// Largest radius on the plane z = 1 of lens models limited to less than 90 degrees from the axis (89.94
// degrees).
inline constexpr double kLargestPlaneRadius = 1000.0;

// Largest radius (tangent of the angle) of the Brown model's one-to-one range.
double LargestBrownRadius(const std::array<double, 5>& k);

// Largest angle of the Kannala-Brandt model's one-to-one range.
double LargestKannalaBrandtAngle(const std::array<double, 5>& k);

// atan(x) / x and tan(x) / x, also at zero.
inline double ArcTangentRatio(double x) {
  return std::abs(x) < 1e-4 ? 1 - x * x / 3 : std::atan(x) / x;
}
inline double TangentRatio(double x) {
  return std::abs(x) < 1e-4 ? 1 + x * x / 3 : std::tan(x) / x;
}

// Distorted radius of the Brown model without its tangential part, and its derivative.
inline double BrownRadius(const std::array<double, 5>& k, double r, double* derivative) {
  const double s = r * r;
  *derivative = 1 + s * (3 * k[0] + s * (5 * k[1] + s * 7 * k[4]));
  return r * (1 + s * (k[0] + s * (k[1] + s * k[4])));
}

// Distorted radius of the Kannala-Brandt model, and its derivative by the angle.
inline double KannalaBrandtRadius(const std::array<double, 5>& k, double angle, double* derivative) {
  const double s = angle * angle;
  *derivative = 1 + s * (3 * k[0] + s * (5 * k[1] + s * (7 * k[2] + s * 9 * k[3])));
  return angle * (1 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3]))));
}

// Solves radius(x) = target on [0, limit], where radius grows from zero to at least the target.
double InvertRadius(double (*radius)(const std::array<double, 5>&, double, double*),
                    const std::array<double, 5>& k, double target, double limit);

// The Brown model on the plane z = 1 with its (symmetric) Jacobian. `Out` receives x, y, xx, xy, yy as in
// CameraModel::ImagePoint. After inlining, outputs that the caller does not use are not computed.
template <typename Out>
inline void BrownDistort(const std::array<double, 5>& k, double x, double y, Out* out) {
  const double s = x * x + y * y;
  const double radial = 1 + s * (k[0] + s * (k[1] + s * k[4]));
  const double twice_slope = 2 * (k[0] + s * (2 * k[1] + s * 3 * k[4]));  // derivative of radial by s
  const double px = k[3], py = k[2];
  const double scale = radial + 2 * (px * x + py * y);
  out->x = scale * x + px * s;
  out->y = scale * y + py * s;
  out->xx = scale + (twice_slope * x + 4 * px) * x;
  out->xy = twice_slope * x * y + 2 * (px * y + py * x);
  out->yy = scale + (twice_slope * y + 4 * py) * y;
}

// Inverse of BrownDistort within max_radius, at which the distorted radius without the tangential part is
// max_image_radius; empty if there is none.
std::optional<Eigen::Vector2d> BrownUndistort(const std::array<double, 5>& k,
                                              const Eigen::Vector2d& distorted, double max_radius,
                                              double max_image_radius);

}  // namespace docent::engine

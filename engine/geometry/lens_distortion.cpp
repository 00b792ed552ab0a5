// SPDX-License-Identifier: Apache-2.0
#include "engine/geometry/lens_distortion.h"

#include <algorithm>
#include <limits>
#include <numbers>
#include <vector>

#include "engine/geometry/polynomial.h"

namespace docent::engine {

namespace {

// The one-to-one range ends slightly before the radius at which the image radius stops growing.
constexpr double kRangeMargin = 1 - 1e-6;
constexpr int kMaxNewtonSteps = 100;

// The argument up to which the polynomial, positive at zero, stays positive; `limit` if it always does.
double PositiveUpTo(const std::vector<double>& coefficients, double limit) {
  const std::vector<double> changes = SignChanges(coefficients, limit);
  return changes.empty() ? limit : changes.front() * kRangeMargin;
}

struct BrownError {
  double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  double norm = 0;

  BrownError(const std::array<double, 5>& k, const Eigen::Vector2d& at, const Eigen::Vector2d& distorted) {
    BrownDistort(k, at.x(), at.y(), this);
    x -= distorted.x();
    y -= distorted.y();
    norm = std::hypot(x, y);
  }
  Eigen::Vector2d NewtonStep() const {
    const double determinant = xx * yy - xy * xy;
    return {(yy * x - xy * y) / determinant, (xx * y - xy * x) / determinant};
  }
};

}  // namespace

// The Jacobian of the distortion
// is symmetric; at radius r its radial part has the eigenvalues d(r) and (r d(r))', and its tangential part's
// are at least -6 |p| r. Where it is positive definite on a disc the mapping is one-to-one there.
double LargestBrownRadius(const std::array<double, 5>& k) {
  const double tangential = -6 * std::hypot(k[2], k[3]);
  const std::vector<double> across = {1, tangential, k[0], 0, k[1], 0, k[4]};
  const std::vector<double> along = {1, tangential, 3 * k[0], 0, 5 * k[1], 0, 7 * k[4]};
  return std::min(PositiveUpTo(across, kLargestPlaneRadius), PositiveUpTo(along, kLargestPlaneRadius));
}

double LargestKannalaBrandtAngle(const std::array<double, 5>& k) {
  return PositiveUpTo({1, 0, 3 * k[0], 0, 5 * k[1], 0, 7 * k[2], 0, 9 * k[3]}, std::numbers::pi);
}

// Newton's method, with bisection where a step leaves the bracket.
double InvertRadius(double (*radius)(const std::array<double, 5>&, double, double*),
                    const std::array<double, 5>& k, double target, double limit) {
  double low = 0, high = limit, x = std::min(target, limit);
  for (int i = 0; i < kMaxNewtonSteps; ++i) {
    double derivative;
    const double error = radius(k, x, &derivative) - target;
    (error > 0 ? high : low) = x;
    double next = x - error / derivative;
    if (!(next >= low && next <= high)) {
      next = 0.5 * (low + high);
    }
    const double step = std::abs(next - x);
    x = next;
    if (step <= 4 * std::numeric_limits<double>::epsilon() * x) {
      break;
    }
  }
  return x;
}

// Starts at the solution without the tangential part and continues with Newton steps that are halved until
// they reduce the error.
std::optional<Eigen::Vector2d> BrownUndistort(const std::array<double, 5>& k,
                                              const Eigen::Vector2d& distorted, double max_radius,
                                              double max_image_radius) {
  const double image_radius = distorted.norm();
  const bool is_radial = k[2] == 0 && k[3] == 0;
  if (image_radius == 0 && is_radial) {
    return Eigen::Vector2d::Zero().eval();
  }
  if (!std::isfinite(image_radius) || (is_radial && image_radius > max_image_radius)) {
    return std::nullopt;
  }
  Eigen::Vector2d x = distorted;
  if (image_radius > 0) {
    const double radius = InvertRadius(BrownRadius, k, std::min(image_radius, max_image_radius), max_radius);
    x *= radius / image_radius;
  }
  if (is_radial) {
    return x;
  }
  const double tolerance = 1e-14 * (1 + image_radius);
  BrownError error(k, x, distorted);
  for (int i = 0; i < kMaxNewtonSteps && error.norm > tolerance; ++i) {
    Eigen::Vector2d step = error.NewtonStep();
    Eigen::Vector2d next = x - step;
    BrownError next_error(k, next, distorted);
    for (int halving = 0; halving < 30 && (next.norm() > max_radius || next_error.norm > error.norm);
         ++halving) {
      step *= 0.5;
      next = x - step;
      next_error = BrownError(k, next, distorted);
    }
    if (!(next.norm() <= max_radius) || !(next_error.norm < error.norm)) {
      break;
    }
    x = next;
    error = next_error;
  }
  if (!(error.norm <= 1e-10 * (1 + image_radius))) {
    return std::nullopt;
  }
  return x;
}

}  // namespace docent::engine

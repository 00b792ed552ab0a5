// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>

#include "engine/geometry/rigid3.h"

namespace docent::engine {

// The point seen along ray_a and ray_b (unit vectors in the frames of two cameras), in frame a, map units.
// Minimizes the angular errors to first order (midpoint weighted by inverse squared depth). Empty if the rays
// intersect behind a camera or are parallel to within 1e-9 rad.
std::optional<Eigen::Vector3d> Triangulate(const Eigen::Vector3d& ray_in_a, const Eigen::Vector3d& ray_in_b,
                                           const Rigid3& b_from_a);

// Angle between the rays from two centres to a point, radians.
double ParallaxAngle(const Eigen::Vector3d& center_a, const Eigen::Vector3d& center_b,
                     const Eigen::Vector3d& point);

// A plane { x : normal . x + offset = 0 }, |normal| = 1.
struct Plane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double offset = 0;

  double SignedDistance(const Eigen::Vector3d& x) const { return normal.dot(x) + offset; }
};

// Plane estimate by RANSAC with the given seed, then least squares over its inliers: points nearer than
// inlier_distance (map units). Empty for fewer than three points and for collinear points.
struct PlaneFit {
  Plane plane;
  int inliers = 0;
};
std::optional<PlaneFit> FitPlane(std::span<const Eigen::Vector3d> points, double inlier_distance,
                                 std::uint64_t seed);

}  // namespace docent::engine

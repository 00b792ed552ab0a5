// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "engine/geometry/rigid3.h"

// The homography of a plane between two calibrated views: ray_b ~ H ray_a with a positive factor, and H ~ R +
// t n' / d for the plane n . x_in_a = d. Free functions without state; any thread.
namespace docent::engine {

// The exact homography of four ray pairs, of arbitrary scale but with ray_b . (H ray_a) > 0 for the first
// pair. Empty if three of the rays are coplanar, or if the signs differ, so that no plane in front of both
// cameras satisfies all pairs.
std::optional<Eigen::Matrix3d> SolveFourPoint(std::span<const Eigen::Vector3d, 4> rays_in_a,
                                              std::span<const Eigen::Vector3d, 4> rays_in_b);

// Scales a homography so that its middle singular value is 1, as DecomposeHomography requires; empty if the
// matrix is numerically singular.
std::optional<Eigen::Matrix3d> ScaleHomography(const Eigen::Matrix3d& homography);

// One decomposition of a homography into a relative pose and a plane.
struct PlaneMotion {
  Rigid3 b_from_a;  // translation in units of the plane's distance from a
  Eigen::Vector3d normal_in_a = Eigen::Vector3d::Zero();  // unit; the plane is { x : normal . x = 1 }
};
// The decompositions of a homography that ScaleHomography has scaled: up to four, namely two with both signs
// each (Ma, Soatto, Kosecka and Sastry 2004, section 5.3). Empty for a rotation, which does not determine a
// plane.
std::vector<PlaneMotion> DecomposeHomography(const Eigen::Matrix3d& b_from_a);

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "engine/geometry/rigid3.h"

// The homography of a plane between two calibrated views: ray_b ~ H ray_a with a positive factor, and
// H ~ R + t n' / d for the plane n . x_in_a = d. Free functions without state; any thread.
namespace docent::engine {

// The exact homography of four ray pairs, in any scale but with ray_b . (H ray_a) > 0 for the first. Empty
// where three of the rays lie on one plane through a centre, or where no visible plane does it (signs that
// differ).
std::optional<Eigen::Matrix3d> SolveFourPoint(std::span<const Eigen::Vector3d, 4> rays_in_a,
                                              std::span<const Eigen::Vector3d, 4> rays_in_b);

// Linear least squares over at least four ray pairs (direct linear transform; unit rays need no further
// conditioning), scaled so that the middle singular value is 1 and most rays map onto their partners rather
// than onto their opposites. Empty where the rays do not determine it.
std::optional<Eigen::Matrix3d> FitHomography(std::span<const Eigen::Vector3d> rays_in_a,
                                             std::span<const Eigen::Vector3d> rays_in_b);

// Scales a homography so that its middle singular value is 1, as DecomposeHomography wants it; empty when it
// is singular beyond use.
std::optional<Eigen::Matrix3d> ScaleHomography(const Eigen::Matrix3d& homography);

// One reading of a homography as a motion past a plane.
struct PlaneMotion {
  Rigid3 b_from_a;                                        // translation in units of the plane's distance
  Eigen::Vector3d normal_in_a = Eigen::Vector3d::Zero();  // unit; the plane is { x : normal . x = 1 }
};
// The up to four readings (two, each with both signs; Ma, Soatto, Kosecka and Sastry 2004, section 5.3) of a
// homography scaled by ScaleHomography. Empty for a rotation: a plane leaves no trace in it.
std::vector<PlaneMotion> DecomposeHomography(const Eigen::Matrix3d& b_from_a);

}  // namespace docent::engine

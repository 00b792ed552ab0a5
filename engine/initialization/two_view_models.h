// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>

#include "engine/geometry/rigid3.h"

// Residuals of ray pairs under a rotation, a homography or an essential matrix, and the least-squares
// refinement of each. All residuals are first-order distances from the model's manifold in the joint space of
// both images (Sampson), in pixels of TwoViewOptions::pixel_angle. With noise of sigma pixels on every
// coordinate of both images, an essential matrix leaves sigma^2 and the other two 2 sigma^2 on average, so
// that the three can be compared. Pure functions; any thread.
namespace docent::engine {

// Unit rays, one pair per row.
struct RayPairs {
  Eigen::Array<double, Eigen::Dynamic, 3> a, b;
  double pixel_angle = 1.0 / 500;  // radians per pixel

  Eigen::Index size() const { return a.rows(); }
  Eigen::Vector3d RayA(Eigen::Index i) const { return a.row(i).transpose().matrix(); }
  Eigen::Vector3d RayB(Eigen::Index i) const { return b.row(i).transpose().matrix(); }
};
RayPairs MakeRayPairs(std::span<const Eigen::Vector3d> rays_in_a, std::span<const Eigen::Vector3d> rays_in_b,
                      double pixel_angle);

// Squared residuals in pixels squared, one per pair.
Eigen::ArrayXd EssentialResiduals(const RayPairs& pairs, const Eigen::Matrix3d& essential);
Eigen::ArrayXd HomographyResiduals(const RayPairs& pairs, const Eigen::Matrix3d& b_from_a);
Eigen::ArrayXd RotationResiduals(const RayPairs& pairs, const Eigen::Matrix3d& b_from_a);

// One weight per pair; a refinement ignores pairs with weight zero.
using Weights = Eigen::ArrayXd;

// Levenberg-Marquardt on the Sampson residuals of [t]x R over the rotation and the direction of the
// translation, with Huber's loss. |translation| = 1 in and out. Never worse than the start.
Rigid3 RefinePose(const RayPairs& pairs, const Weights& weights, const Rigid3& start, double huber_px,
                  int max_iterations);
// The same on the transfer residuals of a homography; the result has Frobenius norm sqrt(3).
Eigen::Matrix3d RefineHomography(const RayPairs& pairs, const Weights& weights, const Eigen::Matrix3d& start,
                                 double huber_px, int max_iterations);
// The rotation that minimizes the weighted sum of |b - R a|^2, in closed form (Kabsch 1976).
Eigen::Matrix3d FitRotation(const RayPairs& pairs, const Weights& weights);

}  // namespace docent::engine

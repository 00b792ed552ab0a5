// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/geometry/rigid3.h"

// The pose of a calibrated camera that sees known points, without any prior: what relocalisation and the
// verification of places rest on. Works on rays, so that any lens will do. Pure functions; any thread;
// deterministic under the seed.
namespace docent::engine {

struct AbsolutePoseOptions {
  double pixel_angle = 1.0 / 500;  // radians a pixel: CameraModel::PixelAngle()
  double inlier_px =
      3.0;  // angle between ray and point, in pixels, at which a correspondence counts as inlier
  int max_iterations = 300;  // RANSAC, stopped earlier at `confidence`
  double confidence = 0.999;
  int min_inliers = 8;  // at least 4: three points fit any pose exactly
  double min_inlier_ratio = 0.0;
  std::uint64_t seed = 1;
};

struct AbsolutePose {
  Rigid3 camera_from_map;
  std::vector<bool> inlier;  // one a correspondence; in front of the camera and within inlier_px
  int inlier_count = 0;
  double rms_px = 0;  // over the inliers
};

// Up to four poses camera_from_map that put three points on three unit rays exactly: the quartic that the law
// of cosines leaves in a ratio of distances (Grunert 1841; Haralick et al. 1994), polished by Newton's method
// on the distances. Empty where the points lie on one line or two rays coincide.
std::vector<Rigid3> SolveThreePoints(std::span<const Eigen::Vector3d, 3> rays_in_camera,
                                     std::span<const Eigen::Vector3d, 3> points_in_map);

// RANSAC over three points with local optimisation, then RefineAbsolutePose. rays_in_camera are unit rays;
// what is not (or not finite) takes no part. Empty where fewer than min_inliers (or min_inlier_ratio of the
// correspondences that take part) agree on a pose.
std::optional<AbsolutePose> EstimateAbsolutePose(std::span<const Eigen::Vector3d> rays_in_camera,
                                                 std::span<const Eigen::Vector3d> points_in_map,
                                                 const AbsolutePoseOptions& options);

// Least squares with Huber's loss (threshold huber_px) over the correspondences with use[i], from a pose near
// the solution; never worse than the start. Empty `use` means all.
Rigid3 RefineAbsolutePose(std::span<const Eigen::Vector3d> rays_in_camera,
                          std::span<const Eigen::Vector3d> points_in_map, const std::vector<bool>& use,
                          const Rigid3& start, double pixel_angle, double huber_px, int max_iterations = 10);

}  // namespace docent::engine

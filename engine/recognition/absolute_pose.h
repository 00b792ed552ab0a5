// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/geometry/rigid3.h"

// The pose of a calibrated camera from matches with points of known position, without a prior. Used for
// relocalization and for the verification of places. Works on rays, for any lens model. Pure functions; any
// thread; deterministic for a given seed.
namespace docent::engine {

struct AbsolutePoseOptions {
  double pixel_angle = 1.0 / 500;  // radians per pixel: CameraModel::PixelAngle()
  double inlier_px = 3.0;          // RANSAC threshold: angle between ray and point in pixels.
  int max_iterations = 300;        // RANSAC; stops earlier at `confidence`
  double confidence = 0.999;
  int min_inliers = 8;  // at least 4: three points fit any pose exactly
  double min_inlier_ratio = 0.0;
  std::uint64_t seed = 1;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

struct AbsolutePose {
  Rigid3 camera_from_map;
  std::vector<bool> inlier;  // one per correspondence; in front of the camera and within inlier_px
  int inlier_count = 0;
  double rms_px = 0;  // over the inliers
};

// Up to four poses camera_from_map that map three points exactly onto three unit rays: the quartic in a ratio
// of distances that follows from the law of cosines (Grunert 1841; Haralick et al. 1994), refined by Newton's
// method on the distances. Empty if the points are collinear or two rays coincide.
std::vector<Rigid3> SolveThreePoints(std::span<const Eigen::Vector3d, 3> rays_in_camera,
                                     std::span<const Eigen::Vector3d, 3> points_in_map);

// RANSAC over three points with local optimization, then RefineAbsolutePose. rays_in_camera: unit rays; other
// or non-finite entries are ignored. Empty if no pose has min_inliers inliers (and min_inlier_ratio of the
// correspondences that are not ignored).
std::optional<AbsolutePose> EstimateAbsolutePose(std::span<const Eigen::Vector3d> rays_in_camera,
                                                 std::span<const Eigen::Vector3d> points_in_map,
                                                 const AbsolutePoseOptions& options);

// Least squares with Huber's loss (threshold huber_px) over the correspondences with use[i], from a pose near
// the solution; the result is never worse than the start. An empty `use` means all.
Rigid3 RefineAbsolutePose(std::span<const Eigen::Vector3d> rays_in_camera,
                          std::span<const Eigen::Vector3d> points_in_map, const std::vector<bool>& use,
                          const Rigid3& start, double pixel_angle, double huber_px, int max_iterations = 10);

}  // namespace docent::engine

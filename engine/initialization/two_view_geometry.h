// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/geometry/rigid3.h"
#include "engine/initialization/depth_significance.h"
#include "engine/initialization/hint.h"

// The relative pose of two calibrated views and the structure between them, without a prior: the five-point
// initialization of ptamm §2.3, made robust against planes, pure rotation and still cameras.
namespace docent::engine {

struct TwoViewOptions {
  double pixel_angle = 1.0 / 500;  // radians per pixel: CameraModel::PixelAngle()
  double inlier_px = 1.5;          // residual below which a correspondence is an inlier
  int max_iterations = 300;        // RANSAC, stopped earlier at `confidence`
  double confidence = 0.999;
  int min_inliers = 50;
  double min_inlier_ratio = 0.6;
  double min_parallax_deg = 1.0;  // median over the inliers; below it the depth is too uncertain
  // Depth is accepted only if it is significant; see DepthSignificance.
  DepthNoiseOptions depth_noise;
  double min_parallax_ratio = 4.0;
  double max_relative_depth_sigma = 0.2;
  // A plane parallel to the image gives a ratio of about three however far the camera moves: the perspective
  // that distinguishes it from a rotation grows with the motion just as the calibration errors do. Its depths
  // are more certain, so they are tested more strictly instead.
  double min_plane_parallax_ratio = 2.5;
  double max_plane_depth_sigma = 0.1;
  std::uint64_t seed = 1;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

enum class TwoViewOutcome {
  kGeneral,            // essential matrix, scene with depth
  kPlanar,             // homography with one clear decomposition
  kStill,              // the image did not move
  kPureRotation,       // a rotation explains the motion: nothing to triangulate
  kTooLittleParallax,  // there is translation, but the depth is too uncertain
  kAmbiguousPlane,     // two poses explain the plane equally well
  kTooFewMatches,
  kInconsistent  // no rigid motion explains enough of the matches (moving objects, wrong matches)
};
// What to do so that the next attempt succeeds; kNone if the geometry was accepted.
Hint HintFor(TwoViewOutcome outcome);

struct TwoViewResult {
  TwoViewOutcome outcome = TwoViewOutcome::kTooFewMatches;
  Rigid3 b_from_a;                           // |translation| = 1; valid for kGeneral and kPlanar
  std::vector<Eigen::Vector3d> points_in_a;  // one per correspondence, baseline 1; valid where inlier
  std::vector<bool> inlier;                  // in front of both views, small residual, finite depth
  int inlier_count = 0;
  double median_parallax_deg = 0;
  DepthSignificance significance;  // valid for kGeneral, kPlanar and some of kTooLittleParallax
};

// rays_in_a[i] and rays_in_b[i] are unit rays of the same scene point. Estimates an essential matrix
// (five-point, Nister 2004 / Stewenius 2006, LO-RANSAC), a homography and a pure rotation, selects one by a
// model-selection criterion (Torr 1998: GRIC), and rejects ambiguous cases. Refines the chosen pose.
// Deterministic under the seed.
TwoViewResult EstimateTwoViews(std::span<const Eigen::Vector3d> rays_in_a,
                               std::span<const Eigen::Vector3d> rays_in_b, const TwoViewOptions& options);

// How much of the parallax is there that depth needs to be significant: 0 (the camera only rotated, or no
// rigid motion was found) to 1 (enough).
double ParallaxProgress(const TwoViewResult& result, const TwoViewOptions& options);

}  // namespace docent::engine

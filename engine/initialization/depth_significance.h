// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "engine/geometry/rigid3.h"
#include "engine/initialization/two_view_models.h"

// How certain the depths are that two views determine. Even under pure rotation some parallax remains: from
// the noise of the keypoints, from an imperfect calibration, and from the skew of a rolling shutter. Depth is
// significant only if the parallax that remains after the best rotation exceeds all of these. Pure functions;
// any thread.
namespace docent::engine {

struct DepthNoiseOptions {
  // Standard deviation of the calibration error of a keypoint's motion between the two images, as a ratio of
  // that motion. A focal length that is wrong by 1 % changes the motion at the corners of a 60 degree image
  // by 0.3 % relative to the centre; radial distortion that is wrong by 0.5 pixels at the corner of a 640x480
  // image changes it by 0.4 % (derivative of 0.5 (r / R)^3 at r = R = 400). The value is twice their sum.
  double calibration_share = 0.014;
  // Standard deviation of the rolling-shutter error, as a ratio of speed_change_px. If the image motion
  // differs by `speed_change_px` pixels per frame between the views, rows that are read over 60 % of a frame
  // interval (20 ms at 30 Hz) are displaced with a standard deviation of 0.17 of that difference; a rotation
  // compensates about two thirds of such a shear.
  double rolling_shutter_share = 0.06;
  double speed_change_px = 0;  // pixels per frame; two views cannot determine it, so the caller measures it
  // The calibration and shutter errors are smooth over the image, so N measurements reduce them no more than
  // this number of independent ones would.
  double smooth_modes = 10;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

struct DepthSignificance {
  // Robust standard deviation of one image coordinate, in pixels: of the residuals of the best rotation, and
  // of what noise, calibration and rolling shutter together are expected to cause.
  double parallax_px = 0, expected_error_px = 0;
  // Median over the inliers of the standard deviation of the inverse depth, relative to the inverse depth. It
  // includes the uncertainty of the pose (first-order covariance of its five parameters) and the smooth
  // errors.
  double relative_depth_sigma = 1e9;

  double Ratio() const { return expected_error_px > 0 ? parallax_px / expected_error_px : 0; }
};

// What is known about the structure. On a plane both coordinates of every keypoint constrain the pose, and
// all depths share the three parameters of the plane; the epipolar constraint alone does not determine the
// pose there.
enum class StructureModel { kGeneral, kPlane };

// inlier: one flag per pair, true for the pairs that agree with the pose. b_from_a: |translation| = 1.
// noise_px: standard deviation of one image coordinate of a keypoint, in pixels.
DepthSignificance MeasureDepthSignificance(const RayPairs& pairs, const std::vector<bool>& inlier,
                                           const Rigid3& b_from_a, StructureModel model, double noise_px,
                                           const DepthNoiseOptions& options);

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/geometry/rigid3.h"
#include "engine/mapping/two_view_models.h"

// How well two views know the depth of what they show. A camera that only turned also leaves a parallax: the
// noise of the measured keypoints, what an imperfect calibration does to a rotation, and the skew of a
// rolling shutter. Depth is significant only where the parallax that is left after the best rotation exceeds
// all of these. Pure functions; any thread.
namespace docent::engine {

struct DepthNoiseOptions {
  // What the calibration leaves of the motion of a keypoint between the two images, as a share of that
  // motion. A focal length that is wrong by 1 % moves the corners of a 60 degree image by 0.3 % of the motion
  // against its middle; radial distortion that is wrong by 0.5 pixels at the corner of a 640x480 image by 0.4
  // % (derivative of 0.5 (r / R)^3 at r = R = 400). Twice their sum.
  double calibration_share = 0.014;
  // Images are taken row by row. Where the image moves by `speed_change_px` more pixels a frame in one view
  // than in the other, rows that are read over 60 % of a frame interval (20 ms at 30 Hz) are displaced with a
  // standard deviation of 0.17 of this; a rotation takes up about two thirds of such a shear.
  double rolling_shutter_share = 0.06;
  double speed_change_px = 0;  // unknown to the two views alone: the caller measures it
  // These errors are smooth over the image: N measurements average them no better than so many do.
  double smooth_modes = 10;
};

struct DepthSignificance {
  // Robust standard deviation (one image coordinate, pixels) of what the best rotation leaves, and what
  // noise, calibration and shutter together explain of it.
  double parallax_px = 0, explained_px = 0;
  // Median over the inliers of the standard deviation of the inverse depth, relative to the inverse depth,
  // with the uncertainty of the pose (first-order covariance of its five parameters) and the smooth errors.
  double relative_depth_sigma = 1e9;

  double Ratio() const { return explained_px > 0 ? parallax_px / explained_px : 0; }
};

// What is known of the structure. On a plane both coordinates of every keypoint tell of the pose, and all
// depths share the three parameters of the plane; epipolar lines alone do not determine the pose there.
enum class StructureModel { kGeneral, kPlane };

// inlier: one a pair, the pairs that the pose explains. b_from_a: |translation| = 1. noise_px: standard
// deviation of one image coordinate of a measured keypoint.
DepthSignificance MeasureDepthSignificance(const RayPairs& pairs, const std::vector<bool>& inlier,
                                           const Rigid3& b_from_a, StructureModel model, double noise_px,
                                           const DepthNoiseOptions& options);

}  // namespace docent::engine

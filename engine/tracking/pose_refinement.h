// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"

namespace docent::engine {

// One point found in the frame: where it is in the map, where it was seen, and how well.
struct PoseMeasurement {
  Eigen::Vector4d point_in_map;
  Eigen::Vector2d pixel;     // level 0
  double inverse_sigma = 1;  // 1 / pixels; 2^-level (ptamm §2.1)
  double weight = 1;         // out: robust weight at the end, 0 for an outlier
};

struct PoseRefinementOptions {
  int iterations = 10;          // ptamm §2.1: ten are adequate
  double tukey_factor = 4.685;  // times the robust sigma: 95 % efficiency under Gaussian noise
  double min_sigma = 0.5;       // of the normalised residuals: below it the noise is better than the model
  double min_weight = 1e-3;     // a measurement with less is an outlier
};

struct PoseRefinement {
  Rigid3 camera_from_map;
  Eigen::Matrix<double, 6, 6> covariance;  // of the left twist in the camera frame
  double sigma = 0;                        // robust, of the normalised residuals
  int inliers = 0;
  bool converged = false;  // also false where the measurements do not hold all six degrees of freedom
};

// Robust Gauss-Newton on reprojection errors from `start` (ptamm eq. 1-3): Huber while far away, Tukey for
// the last iterations. Does not allocate beyond *scratch.
PoseRefinement RefinePose(const CameraModel& camera, const Rigid3& start,
                          const PoseRefinementOptions& options, std::vector<PoseMeasurement>* measurements,
                          std::vector<double>* scratch);

}  // namespace docent::engine

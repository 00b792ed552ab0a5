// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"

namespace docent::engine {

// One point found in the frame: where it is in the map, where it was seen, and how well.
struct PoseMeasurement {
  Eigen::Vector4d point_in_map;  // homogeneous
  Eigen::Vector2d pixel;         // level 0
  double inverse_sigma = 1;      // 1 / pixels; 2^-level (ptamm §2.1)
  double weight = 1;             // out: robust weight at the end, 0 for an outlier
  // It tells a direction alone; its w is 0 or says how near it is presumed to be.
  bool direction = false;

  bool infinite() const { return direction || point_in_map[3] == 0; }
};

struct PoseRefinementOptions {
  int iterations = 10;            // ptamm §2.1: ten are adequate
  double tukey_factor = 4.685;    // times the robust sigma: 95 % efficiency under Gaussian noise
  double min_sigma = 0.5;         // of the normalised residuals: below it the noise is better than the model
  double min_weight = 1e-3;       // a measurement with less is an outlier
  double infinite_weight = 0.01;  // of an infinite point beside finite ones (hybrid-slam §3.1)
  // With fewer finite points there is no telling where the camera moved: beside infinite ones it is taken to
  // have turned only (hybrid-slam §4.3).
  int min_finite = 15;
  // Nor is there where they say it less surely than this, of the depth of what they show: a few points at the
  // rim of the image err together, by ten times what each by itself would let one think. Then the camera is
  // taken to have turned, and to have moved beside that by no more than about as much: where the points do
  // tell something of the way, it is not thrown away.
  double max_position_sigma = 0.003;
  // As far goes a camera beside a turn that is sure, in a frame; of the depth too, and taken as much less as
  // points seem surer than they are. It counts from half of max_position_sigma on: what places the camera
  // well must be free to say that it turns no more.
  double prior_translation_sigma = 0.0003;
};

// What the measurements could tell of the pose.
enum class ObservedMotion : std::uint8_t {
  kSixDof,    // rotation and translation, from finite points
  kHybrid,    // the same, with infinite points beside
  kPanorama,  // the rotation alone; the pivot (or the camera's own centre) is about where it was at the start
};

struct PoseRefinement {
  Rigid3 camera_from_map;
  // Of the left twist in the camera frame; zero for a translation that was not estimated.
  Eigen::Matrix<double, 6, 6> covariance;
  // The same without the turn that was expected; where `observed` is not kPanorama.
  Rigid3 camera_from_map_without_prior;
  ObservedMotion observed = ObservedMotion::kSixDof;
  double sigma = 0;  // robust, of the normalised residuals
  int inliers = 0;
  int finite_inliers = 0;  // of these
  double mean_depth = 0;   // of the finite inliers; 0 for none
  bool converged = false;  // also false where the measurements do not hold the degrees of freedom asked for
};

// The turn that the motion so far lets expect.
struct RotationPrior {
  // A point that stays where `camera_from_map` has it; camera frame, zero for the camera's own centre.
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero();
  Rigid3 camera_from_map;
  // Else it is resorted to only where the place cannot be told and infinite points are seen.
  bool sure = false;
};

// What a refinement writes while it works; kept by its caller, so that the next one need not allocate.
struct PoseRefinementMemory {
  struct Seen {
    Eigen::Vector3d point_in_camera;       // homogeneous as the measurement's
    Eigen::Vector2d error;                 // normalised by sigma
    Eigen::Matrix<double, 2, 3> jacobian;  // d normalised pixel / d point_in_camera
    bool valid = false;
  };
  std::vector<Seen> seen;  // one a measurement
  std::vector<double> squared_errors;
};

// Robust Gauss-Newton on reprojection errors of finite and infinite points from `start` (ptamm eq. 1-3,
// hybrid-slam eq. 1-2): Huber while far away, Tukey for the last iterations. The scale of the errors is
// estimated for each kind by itself: what little translation does to infinite points is no noise of finite
// ones. Does not allocate beyond *memory.
PoseRefinement RefinePose(const CameraModel& camera, const Rigid3& start,
                          const PoseRefinementOptions& options, std::vector<PoseMeasurement>* measurements,
                          PoseRefinementMemory* memory, const RotationPrior& turn);

}  // namespace docent::engine

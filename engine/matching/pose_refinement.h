// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"

namespace docent::engine {

// A map point found in the frame: its position in the map, its pixel and the accuracy of the pixel.
struct PoseMeasurement {
  Eigen::Vector4d point_in_map;  // homogeneous
  Eigen::Vector2d pixel;         // level 0
  double inverse_sigma = 1;      // 1 / pixels; 2^-level (ptamm §2.1)
  double weight = 1;             // output: final robust weight, 0 for an outlier
  // The point constrains the rotation only; its fourth coordinate is 0 or an assumed inverse distance.
  bool direction = false;

  bool infinite() const { return direction || point_in_map[3] == 0; }
};

// A prediction of the camera centre in the map, map units.
struct PredictedPosition {
  Eigen::Vector3d center;
  double sigma = 0;  // standard deviation of each coordinate
};

struct PoseRefinementOptions {
  int iterations = 10;          // ptamm §2.1: ten are adequate
  double tukey_factor = 4.685;  // times the robust sigma: 95 % efficiency under Gaussian noise
  // Lower bound of the normalized residuals' sigma: a smaller value is more optimistic than the noise model.
  double min_sigma = 0.5;
  double min_weight = 1e-3;       // A measurement with a smaller weight is an outlier.
  double infinite_weight = 0.01;  // weight of an infinite point when there are finite ones (hybrid-slam §3.1)
  // With fewer finite points than this the translation is not observable: if there are infinite points, only
  // the rotation is estimated (hybrid-slam §4.3).
  int min_finite = 15;
  // The errors of a position are this many times those that the covariance of independent errors predicts:
  // points near one another have errors of the map in common. In visits to saved maps of a rendered room the
  // errors were 4 times as large in the middle of 890 images, and 8 times at the 90 % quantile.
  double common_error_factor = 10;
  // Largest standard deviation of the camera position for independent errors, as a ratio of the mean depth,
  // at which the finite points determine the translation. Above this value the motion is taken for a
  // rotation, and the translation is constrained to this size rather than fixed, so that the information in
  // the finite points is still used.
  double max_position_sigma = 0.003;
  // Standard deviation of the translation between frames during a reliable rotation, as a ratio of the mean
  // depth; smaller than the true one by common_error_factor. Priors apply above half of max_position_sigma,
  // so that well determined positions can end the rotation.
  double prior_translation_sigma = 0.0003;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// The degrees of freedom that the measurements determine.
enum class ObservedMotion : std::uint8_t {
  kSixDof,    // rotation and translation, from finite points
  kHybrid,    // rotation and translation, from finite and infinite points
  kPanorama,  // rotation only; the pivot (or the camera centre) keeps about its initial position
};

struct PoseRefinement {
  Rigid3 camera_from_map;
  // Of the left twist in the camera frame; zero for a translation that was not estimated.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  // The pose without the rotation prior; set unless the rotation alone was estimated.
  Rigid3 camera_from_map_without_prior;
  ObservedMotion observed = ObservedMotion::kSixDof;
  double sigma = 0;  // robust, of the normalized residuals
  int inliers = 0;
  int finite_inliers = 0;    // contained in `inliers`
  double mean_depth = 0;     // map units, of the finite inliers; 0 if there are none
  bool used_center = false;  // the predicted centre is part of the estimate
  bool converged = false;  // false too if the measurements do not determine the degrees of freedom asked for
};

// What the previous motion predicts.
struct MotionPrior {
  // The fixed point of the rotation in the camera frame; zero for the camera centre. camera_from_map gives
  // its position in the map.
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero();
  Rigid3 camera_from_map;
  // If false, the pivot is used only where the translation is not observable and infinite points are
  // projections.
  bool reliable = false;
  // Where the camera centre is predicted, if it is; used where neither the points nor a rotation determine
  // it.
  std::optional<PredictedPosition> center = std::nullopt;
};

// Working memory of RefinePose. The caller keeps it to avoid allocations.
struct PoseRefinementMemory {
  struct Projection {
    Eigen::Vector3d point_in_camera;       // homogeneous like the measurement
    Eigen::Vector2d error;                 // normalized by the sigma of the level
    Eigen::Matrix<double, 2, 3> jacobian;  // d normalized pixel / d point_in_camera
    bool valid = false;
  };
  std::vector<Projection> projections;  // one per measurement
  std::vector<double> squared_errors;
};

// The camera model of an image, given an estimate of its pose: the motion of the camera during the readout of
// a rolling shutter depends on the pose.
using CameraAtPose = std::function<std::shared_ptr<const CameraModel>(const Rigid3& camera_from_map)>;

// Robust Gauss-Newton on the reprojection errors of finite and infinite points from `start` (ptamm eq. 1-3,
// hybrid-slam eq. 1-2), with Huber weights in the first iterations and Tukey weights in the last. The error
// scales of finite and infinite points are estimated separately, because a small translation shifts infinite
// points and must not count as noise of finite ones. Allocates only in *memory. camera_at_pose: if not empty,
// the iterations with Tukey weights use the model that it returns for the pose of those with Huber weights.
PoseRefinement RefinePose(const CameraModel& camera, const Rigid3& start,
                          const PoseRefinementOptions& options, std::vector<PoseMeasurement>* measurements,
                          PoseRefinementMemory* memory, const MotionPrior& prior,
                          const CameraAtPose& camera_at_pose = nullptr);

}  // namespace docent::engine

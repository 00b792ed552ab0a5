// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/option_check.h"
#include "engine/base/time.h"
#include "engine/geometry/rigid3.h"

namespace docent::engine {

struct RotationCenterOptions {
  bool enabled = true;  // if false, every rotation is about the camera centre (hybrid-slam §4.3)
  Timestamp window = std::chrono::milliseconds(2000);  // age of the oldest pose used
  Timestamp interval = std::chrono::milliseconds(30);  // between the poses used
  int min_poses = 8;
  double min_rotation_deg = 8.0;  // Smallest rotation within the window that the estimate needs.
  double position_noise = 0.002;  // of a tracked camera centre, as a ratio of the median depth
  double rotation_noise = 0.01;   // radians; rotations about an axis below this do not determine the pivot
  // Poses with a larger position sigma are ignored; a ratio of the median depth.
  double max_position_sigma = 0.01;
  // Largest distance of a pivot, as a ratio of the median depth: beyond it the camera translates.
  double max_distance = 2.0;
  // Largest residual that the rotation leaves, as a ratio of the spread of the centres.
  double max_residual_ratio = 0.25;
  // The same for a reliable pivot, and as a ratio of the median depth. A person who walks while rotating
  // leaves larger residuals.
  double max_reliable_residual_ratio = 0.08;
  double max_reliable_residual = 0.006;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// The pivot that the camera rotates about.
struct PivotEstimate {
  // Camera frame, map units. Zero for the camera centre, also if the poses do not determine a pivot.
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero();
  bool reliable = false;  // the recent poses fit a pure rotation about the pivot closely
};

// A camera in the hand or on the head rotates about the person, not about its own centre. This class
// estimates the point that stayed fixed during the recent rotation, so that a rotation without finite points
// can be continued about it. (An extension of hybrid-slam §4.3, which rotates about the camera centre.) Each
// tracker owns one and uses it on its thread; it does not allocate once the window is full.
class RotationCenter {
 public:
  explicit RotationCenter(const RotationCenterOptions& options) : options_(Checked(options)) {}

  // To be called when the next pose does not continue the previous ones.
  void Reset() { poses_.clear(); }
  // Adds a pose that finite points determine. covariance: of the left twist, camera frame. depth: median
  // depth of the visible points, map units.
  void Add(Timestamp time, const Rigid3& camera_from_map, const Eigen::Matrix<double, 6, 6>& covariance,
           double depth);
  // The pivot of the recent rotation. depth: as in Add.
  PivotEstimate Estimate(double depth) const;

 private:
  struct Pose {
    Timestamp time;
    Eigen::Matrix3d map_from_camera;
    Eigen::Vector3d center;
  };
  const RotationCenterOptions options_;
  std::vector<Pose> poses_;  // ascending in time
};

// The pose with this rotation that keeps the point `pivot` (camera frame) at its position under
// `camera_from_map`.
Rigid3 RotatedAbout(const Eigen::Vector3d& pivot, const Rigid3& camera_from_map, const Rotation3& rotation);

}  // namespace docent::engine

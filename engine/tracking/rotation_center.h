// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/rigid3.h"

namespace docent::engine {

struct RotationCenterOptions {
  bool enabled = true;  // else every turn is about the camera's own centre (hybrid-slam §4.3)
  Timestamp window = std::chrono::milliseconds(2000);  // of poses that are looked at
  Timestamp interval = std::chrono::milliseconds(30);  // between them
  int min_poses = 8;
  double min_turn_deg = 8.0;         // between the views of the window: less does not tell a centre
  double position_noise = 0.002;     // of the depth, of a tracked centre
  double rotation_noise = 0.01;      // radians; a turn that shows no more tells nothing
  double max_position_sigma = 0.01;  // of the depth, of poses that are taken
  double max_distance = 2.0;         // of the depth: further off, the camera walks and does not turn
  double max_misfit = 0.25;          // share of the centres' spread that turning leaves unexplained
  // Less than this, and of the depth, and it surely turns: a hand that walks while it turns leaves more.
  double max_sure_misfit = 0.08;
  double max_sure_offset = 0.006;
};

// What the camera turns about.
struct Turn {
  // Camera frame, units of the map; zero, the camera's own centre, also where the poses do not tell one.
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero();
  bool sure = false;  // the poses of the last moments leave next to no doubt that the camera turns about it
};

// A camera in the hand or on the head turns about the person, not about its own centre. From the poses of the
// last moments this finds the point that stayed where it was while the camera turned, so that a turn that no
// finite point can tell is taken to go on about it. (Past hybrid-slam §4.3, which turns about the centre.)
// One a tracker, on its thread; allocates nothing once the window is full.
class RotationCenter {
 public:
  explicit RotationCenter(const RotationCenterOptions& options) : options_(options) {}

  // The poses that follow do not continue those before.
  void Reset() { poses_.clear(); }
  // A pose that finite points told. covariance: of the left twist, camera frame; depth: of what it looks at.
  void Add(Timestamp time, const Rigid3& camera_from_map, const Eigen::Matrix<double, 6, 6>& covariance,
           double depth);
  // What the camera turned about in the last moments. depth: of what it looks at.
  Turn Estimate(double depth) const;

 private:
  struct Pose {
    Timestamp time;
    Eigen::Matrix3d map_from_camera;
    Eigen::Vector3d center;
  };
  const RotationCenterOptions options_;
  std::vector<Pose> poses_;  // ascending in time
};

// The pose with this rotation that leaves the point `pivot` (camera frame) where `camera_from_map` has it.
Rigid3 RotatedAbout(const Eigen::Vector3d& pivot, const Rigid3& camera_from_map, const Rotation3& rotation);

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/base/option_check.h"
#include "engine/tracking/tracked_frame.h"

namespace docent::engine {

struct InitializationMonitorOptions {
  // Points without a true depth are lost as soon as the camera moves: after false initializations of a real
  // drone and of a real hand-held camera the inliers fell from 330 to 30 within 0.5 to 2 seconds. Below this
  // ratio of the initial inlier ratio, halfway between that and a map that keeps most of its points, the map
  // is considered false.
  double min_inlier_ratio_kept = 0.4;
  // Periods over which the initial and the recent inlier ratio are averaged.
  Timestamp initial_period = std::chrono::milliseconds(200);
  Timestamp recent_period = std::chrono::milliseconds(200);
  // At least three samples are averaged. Where there are fewer images, the period is longer, up to this one.
  Timestamp longest_recent_period = std::chrono::milliseconds(600);
  // Beyond this distance from its first view (ratio of the median depth) or this rotation, the points of a
  // correct map may be out of view.
  double max_distance = 0.3;
  double max_rotation = 0.35;  // radians
  // A camera that relocalizes in the map within this time after its last pose there should be where it was.
  // If its position has jumped by more than this ratio of the median depth beyond what it moved before, the
  // map contradicts itself. Only the first camera is compared, as another one is elsewhere. In 1,180 windows
  // of three real recordings, only a map with false depth relocalized a camera at all, after 0.9 s: it jumped
  // by more than a tenth of the depth from one image to the next.
  Timestamp max_gap = std::chrono::milliseconds(200);
  double max_jump = 0.05;
  // If the viewing direction has jumped by more than this as well, in radians, the jump is no evidence: false
  // depth changes the position of a camera, but hardly its rotation. The recording has a gap then, or
  // somebody hit the camera. A hand that turns by 100 degrees a second and stops within a tenth of a second
  // stays below it.
  double max_rotation_jump = 0.17;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Checks, in the first frames that are tracked in a new map with finite points, whether its depth is false.
// One for each new map; its owner guards it.
class InitializationMonitor {
 public:
  explicit InitializationMonitor(const InitializationMonitorOptions& options = {})
      : options_(Checked(options)) {}

  // To be called with every frame that is tracked in the map, by ascending time. A frame for which the map
  // gave the rotation alone counts with an inlier ratio of 0.
  void Add(const TrackedFrame& frame);
  // Evidence that the depth of the map is wrong: a jump when the camera relocalized, or else an inlier ratio
  // that fell.
  struct Fault {
    double initial_inlier_ratio = 0, recent_inlier_ratio = 0;
    double jump = 0;  // ratio of the median depth; 0 if there was none
  };
  // Empty while the camera has not jumped. Other evidence than FindFault, as a map that most points are found
  // in again may be false too.
  std::optional<Fault> FindJump() const;
  // Empty while there is no evidence.
  std::optional<Fault> FindFault() const;

 private:
  struct Sample {
    Timestamp time{};
    double inlier_ratio = 0;
  };
  InitializationMonitorOptions options_;
  std::optional<Rigid3> first_pose_;
  Timestamp first_time_{};
  double depth_ = 1;
  double initial_sum_ = 0;
  int initial_count_ = 0;
  std::vector<Sample> recent_;
  bool is_near_ = true;  // the camera is still close to its first view
  struct Pose {
    Timestamp time{};
    Rigid3 camera_from_map;
  };
  void CheckJump(const TrackedFrame& frame);
  std::optional<Pose> last_, before_last_;
  double jump_ = 0;
};

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/option_check.h"
#include "engine/base/time.h"
#include "engine/geometry/rigid3.h"

// Estimates the relative pose of two cameras from the times at which both are tracked in one map.
namespace docent::engine {

// When the estimate of a rig counts as known and as rigid.
struct RigOptions {
  std::size_t window = 300;      // number of the newest relative poses that are kept
  std::size_t min_samples = 45;  // fewer give no estimate
  // Viewpoints must be viewpoint_rotation_deg or more apart, so that standing still does not count as rigid.
  std::size_t min_viewpoints = 4;
  double viewpoint_rotation_deg = 3;       // see min_viewpoints
  double max_rigid_position_sigma = 0.02;  // ratio of the baseline; robust sigma of the relative position
  double max_rigid_rotation_deg = 0.5;     // robust sigma of the relative rotation
  // Between poses that are interpolated: the longest interval of a camera with eight images a second.
  Timestamp max_gap = std::chrono::milliseconds(150);

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Relative pose of two cameras with its uncertainty. Lengths are in map units.
struct RigEstimate {
  Rigid3 second_from_first;       // between the frames of the two cameras
  double position_sigma = 0;      // robust sigma of a single sample about the estimate
  double rotation_sigma_deg = 0;  // the same for the rotation
  std::size_t samples = 0;        // number of relative poses that it was made from
  bool rigid = false;  // whether the cameras keep their relative pose, up to the noise of two trackers

  // The distance of the camera centres.
  double Baseline() const { return second_from_first.translation.norm(); }
};

// The robust mean of relative poses: geometric median of the positions and L1 mean of the rotations by
// Weiszfeld's iteration (Hartley, Aftab and Trumpf 2011), then the mean of the samples within three robust
// sigmas. Tolerates up to half outliers. Needs at least one sample; does not set `rigid`.
RigEstimate RobustRelativePose(const std::vector<Rigid3>& second_from_first);

// Determines from two trackers whether their cameras are rigidly connected. Every pose of one camera is
// compared with the other's pose at the same time, interpolated between its frames, since the cameras are not
// synchronized. Maps differ in scale, so a new map starts a new estimate. Its owner guards it.
class CameraRig {
 public:
  // Begins without an estimate. Throws Error if the options are invalid.
  explicit CameraRig(const RigOptions& options = {}) : options_(Checked(options)) {}

  // camera is 0 or 1; the times of one camera ascend.
  void Add(int camera, Timestamp time, std::uint64_t map_key, const Rigid3& camera_from_map);
  // Empty before min_samples. Updated once every few samples, not at every call.
  const std::optional<RigEstimate>& estimate() const { return estimate_; }
  // The pose of a camera at `time`, predicted from the other's newest pose. Empty unless the rig is rigid and
  // that pose is in the same map and no older than max_gap.
  std::optional<Rigid3> Predict(int camera, Timestamp time, std::uint64_t map_key) const;

 private:
  struct Pose {
    Timestamp time;
    Rigid3 camera_from_map;
  };
  void Match(int camera);
  void Update();

  const RigOptions options_;
  std::uint64_t map_key_ = 0;
  std::deque<Pose> poses_[2];     // the newest few of each camera
  Timestamp matched_until_[2]{};  // time of the newest pose of each camera that was paired with the other
  std::deque<Rigid3> samples_;    // second_from_first
  std::vector<Rotation3> viewpoints_;
  std::size_t since_update_ = 0;
  std::optional<RigEstimate> estimate_;
};

}  // namespace docent::engine

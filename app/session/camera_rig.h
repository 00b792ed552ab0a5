// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/rigid3.h"

// How two cameras stand to each other, learned from the moments at which both are tracked in one map.
namespace docent::app {

struct RigOptions {
  std::size_t window = 300;        // relative poses that are kept, the newest
  std::size_t min_samples = 45;    // fewer say nothing
  std::size_t min_viewpoints = 4;  // apart by rigid_turn_deg or more, so that standing still proves nothing
  double viewpoint_turn_deg = 3;
  double max_rigid_spread = 0.02;   // of the baseline: robust sigma of the relative position
  double max_rigid_turn_deg = 0.5;  // robust sigma of the relative rotation
  Timestamp max_gap = std::chrono::milliseconds(120);  // between poses that are interpolated
};

// Relative pose of two cameras with how well it holds. Lengths in the map's own units.
struct RigEstimate {
  engine::Rigid3 second_from_first;
  double position_spread = 0;  // robust sigma of a single sample about the estimate
  double turn_spread_deg = 0;
  std::size_t samples = 0;
  bool rigid = false;  // the spread is what two trackers leave, not what a moving arm does

  double Baseline() const { return second_from_first.translation.norm(); }
  // "rigid, baseline 0.250 (spread 0.001), turned by 12.3 degrees (spread 0.05)"
  std::string Words() const;
};

// The robust mean of relative poses: geometric median of the positions and L1 mean of the rotations by
// Weiszfeld's iteration (Hartley, Aftab and Trumpf 2011), then the mean of what lies within three robust
// sigmas. Half of the samples may be anything. Needs one sample at least; does not decide `rigid`.
RigEstimate RobustRelativePose(const std::vector<engine::Rigid3>& second_from_first);

// Watches two trackers and says whether their cameras are fixed to one another. Every pose of one camera is
// compared with the other's pose at the same time, interpolated between its frames, since cameras do not
// expose together. Maps have scales of their own, so that a new map begins anew. Its owner guards it.
class CameraRig {
 public:
  explicit CameraRig(const RigOptions& options = {}) : options_(options) {}

  // camera is 0 or 1; times of one camera ascend.
  void Add(int camera, Timestamp time, std::uint64_t map_key, const engine::Rigid3& camera_from_map);
  // Empty while too little was seen. Worked out anew every now and then, not at every call.
  const std::optional<RigEstimate>& estimate() const { return estimate_; }
  // Where a camera must be at `time` by the other's newest pose; empty unless the rig is rigid and that pose
  // is of the same map and fresh.
  std::optional<engine::Rigid3> Predict(int camera, Timestamp time, std::uint64_t map_key) const;

 private:
  struct Pose {
    Timestamp time;
    engine::Rigid3 camera_from_map;
  };
  void Match(int camera);
  void Update();

  const RigOptions options_;
  std::uint64_t map_key_ = 0;
  std::deque<Pose> poses_[2];           // the newest few of each camera
  Timestamp matched_until_[2]{};        // poses up to here have met their counterpart
  std::deque<engine::Rigid3> samples_;  // second_from_first
  std::vector<engine::Rotation3> viewpoints_;
  std::size_t since_update_ = 0;
  std::optional<RigEstimate> estimate_;
};

}  // namespace docent::app

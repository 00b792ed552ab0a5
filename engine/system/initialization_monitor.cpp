// SPDX-License-Identifier: Apache-2.0
#include "engine/system/initialization_monitor.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/base/option_check.h"

namespace docent::engine {

std::optional<std::string> InitializationMonitorOptions::Validate() const {
  return OptionCheck()
      .Ratio(min_inlier_ratio_kept, "inlier ratio kept")
      .NotNegative(initial_period, "initial period")
      .NotNegative(recent_period, "recent period")
      .Positive(max_distance, "distance from the first view")
      .Positive(max_rotation, "rotation from the first view")
      .NotNegative(max_gap, "time before a relocalization")
      .Positive(max_jump, "jump at a relocalization")
      .Positive(max_rotation_jump, "jump of the viewing direction at a relocalization")
      .fault();
}

namespace {

constexpr std::size_t kFewestSamples = 3;

}  // namespace

void InitializationMonitor::Add(const TrackedFrame& frame) {
  if (!HasPose(frame.state) || !frame.map || !frame.map->HasFinitePoints()) return;
  const Timestamp now = frame.frame.time;
  if (!first_pose_) {
    first_pose_ = frame.camera_from_map;
    first_time_ = now;
    const auto localized = std::find_if(frame.map->keyframes.rbegin(), frame.map->keyframes.rend(),
                                        [](const KeyFrame& k) { return k.kind == KeyFrameKind::kSixDof; });
    if (localized != frame.map->keyframes.rend()) depth_ = std::max(localized->mean_depth, 1e-9);
  }
  CheckJump(frame);
  const double inlier_ratio = frame.finite_points > 0 ? frame.quality : 0.0;
  if (now - first_time_ <= options_.initial_period) {
    initial_sum_ += inlier_ratio;
    ++initial_count_;
    return;
  }
  recent_.push_back({now, inlier_ratio});
  const auto has_expired = [&](const Sample& sample) {
    const bool is_needed = recent_.size() <= kFewestSamples;
    return now - sample.time > (is_needed ? options_.longest_recent_period : options_.recent_period);
  };
  while (has_expired(recent_.front())) recent_.erase(recent_.begin());
  const Rigid3 moved = frame.camera_from_map * first_pose_->inverse();
  is_near_ = moved.translation.norm() <= options_.max_distance * depth_ &&
             moved.rotation.Angle() <= options_.max_rotation;
}

void InitializationMonitor::CheckJump(const TrackedFrame& frame) {
  // Another camera is elsewhere, and a pose from directions alone has no position.
  if (frame.frame.camera != 0 || frame.finite_points == 0 || frame.state == TrackingState::kPanorama) return;
  const Pose now{frame.frame.time, frame.camera_from_map};
  if (frame.state == TrackingState::kRelocalized && last_ && before_last_ &&
      now.time - last_->time <= options_.max_gap) {
    const auto distance = [](const Pose& a, const Pose& b) {
      return (a.camera_from_map.OriginInSource() - b.camera_from_map.OriginInSource()).norm();
    };
    const auto rotation = [](const Pose& a, const Pose& b) {
      return (a.camera_from_map.rotation * b.camera_from_map.rotation.inverse()).Angle();
    };
    // What the motion between the two poses before explains.
    const double intervals = ToSeconds(now.time - last_->time) / ToSeconds(last_->time - before_last_->time);
    const double jump = distance(now, *last_) - intervals * distance(*last_, *before_last_);
    const double rotation_jump = rotation(now, *last_) - intervals * rotation(*last_, *before_last_);
    if (jump > options_.max_jump * depth_ && rotation_jump <= options_.max_rotation_jump)
      jump_ = jump / depth_;
  }
  before_last_ = last_;
  last_ = now;
}

std::optional<InitializationMonitor::Fault> InitializationMonitor::FindJump() const {
  if (jump_ == 0) return std::nullopt;
  Fault fault;
  fault.jump = jump_;
  return fault;
}

std::optional<InitializationMonitor::Fault> InitializationMonitor::FindFault() const {
  if (initial_count_ == 0 || recent_.size() < kFewestSamples || !is_near_) return std::nullopt;
  const double initial = initial_sum_ / initial_count_;
  const double recent =
      std::accumulate(recent_.begin(), recent_.end(), 0.0,
                      [](double sum, const Sample& sample) { return sum + sample.inlier_ratio; }) /
      static_cast<double>(recent_.size());
  if (recent >= options_.min_inlier_ratio_kept * initial) return std::nullopt;
  return Fault{initial, recent, 0};
}

}  // namespace docent::engine

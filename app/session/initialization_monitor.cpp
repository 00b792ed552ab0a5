// SPDX-License-Identifier: Apache-2.0
#include "app/session/initialization_monitor.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace docent::app {

void InitializationMonitor::Add(const engine::TrackedFrame& frame) {
  if (!engine::HasPose(frame.state) || !frame.map || !frame.map->HasFinitePoints()) return;
  const Timestamp now = frame.frame.time;
  if (!first_pose_) {
    first_pose_ = frame.camera_from_map;
    first_time_ = now;
    const auto localized =
        std::find_if(frame.map->keyframes.rbegin(), frame.map->keyframes.rend(),
                     [](const engine::KeyFrame& k) { return k.kind == engine::KeyFrameKind::kSixDof; });
    if (localized != frame.map->keyframes.rend()) depth_ = std::max(localized->mean_depth, 1e-9);
  }
  const double inlier_ratio = frame.finite_points > 0 ? frame.quality : 0.0;
  if (now - first_time_ <= options_.initial_period) {
    initial_sum_ += inlier_ratio;
    ++initial_count_;
    return;
  }
  recent_.push_back({now, inlier_ratio});
  std::erase_if(recent_, [&](const Sample& sample) { return now - sample.time > options_.recent_period; });
  const engine::Rigid3 moved = frame.camera_from_map * first_pose_->inverse();
  is_near_ = moved.translation.norm() <= options_.max_distance * depth_ &&
             moved.rotation.Angle() <= options_.max_rotation;
}

std::optional<std::string> InitializationMonitor::Fault() const {
  if (initial_count_ == 0 || recent_.size() < 3 || !is_near_) return std::nullopt;
  const double initial = initial_sum_ / initial_count_;
  const double recent =
      std::accumulate(recent_.begin(), recent_.end(), 0.0,
                      [](double sum, const Sample& sample) { return sum + sample.inlier_ratio; }) /
      static_cast<double>(recent_.size());
  if (recent >= options_.min_inlier_ratio_kept * initial) return std::nullopt;
  const auto percent = [](double inlier_ratio) {
    return std::to_string(std::lround(100 * inlier_ratio)) + " %";
  };
  return "the inlier ratio fell from " + percent(initial) + " to " + percent(recent) +
         " although the camera hardly moved";
}

}  // namespace docent::app

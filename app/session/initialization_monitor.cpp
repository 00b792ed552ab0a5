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
  const double share = frame.finite_points > 0 ? frame.quality : 0.0;
  if (now - first_time_ <= options_.first_share) {
    first_sum_ += share;
    ++first_count_;
    return;
  }
  recent_.push_back({now, share});
  std::erase_if(recent_, [&](const Sample& sample) { return now - sample.time > options_.recent_share; });
  const engine::Rigid3 moved = frame.camera_from_map * first_pose_->inverse();
  near_ = moved.translation.norm() <= options_.max_distance * depth_ &&
          moved.rotation.Angle() <= options_.max_turn;
}

std::optional<std::string> InitializationMonitor::Fault() const {
  if (first_count_ == 0 || recent_.size() < 3 || !near_) return std::nullopt;
  const double first = first_sum_ / first_count_;
  const double recent = std::accumulate(recent_.begin(), recent_.end(), 0.0,
                                        [](double sum, const Sample& sample) { return sum + sample.share; }) /
                        static_cast<double>(recent_.size());
  if (recent >= options_.min_share_kept * first) return std::nullopt;
  const auto percent = [](double share) { return std::to_string(std::lround(100 * share)) + " %"; };
  return "the share of its points that are found fell from " + percent(first) + " to " + percent(recent) +
         " while the camera hardly moved";
}

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#include "app/session/head_control.h"

#include <cmath>

namespace docent::app {

namespace {

constexpr Timestamp kMinLossTime =
    std::chrono::milliseconds(400);  // after a shorter loss, tracking usually recovers without a search
constexpr Timestamp kMinTimeBetweenMoves = std::chrono::milliseconds(500);
constexpr double kMinMove_rad = 0.09;

std::vector<engine::MapPointId> Inliers(const engine::TrackedFrame& frame) {
  std::vector<engine::MapPointId> seen;
  for (const engine::PointMatch& match : frame.matches) {
    if (match.inlier) seen.push_back(match.point);
  }
  return seen;
}

}  // namespace

void HeadControl::AddView(const engine::TrackedFrame& frame) {
  if (frame.state == engine::TrackingState::kDropped) return;
  const std::scoped_lock lock(mutex_);
  if (frame.frame.camera != camera_) {
    gaze_.reset();
    if (!engine::HasPose(frame.state) || !frame.map) return;
    gaze_ = GazePoint(*frame.map, Inliers(frame));
    gaze_key_ = frame.map_key;
    return;
  }
  const PanTilt at = head_->At(frame.frame.time);
  engine::HasPose(frame.state) ? HandleTracked(frame, at) : HandleLost(frame, at);
}

bool HeadControl::searching() const {
  const std::scoped_lock lock(mutex_);
  return search_.has_value();
}

void HeadControl::HandleTracked(const engine::TrackedFrame& frame, const PanTilt& at) {
  search_.reset();
  map_ = frame.map;
  map_key_ = frame.map_key;
  carrier_from_map_ = engine::Rigid3(CarrierFromCamera(at), Eigen::Vector3d::Zero()) * frame.camera_from_map;
  tracked_at_ = frame.frame.time;
  if (!map_ || !map_->HasFinitePoints() || frame.frame.time - moved_at_ < kMinTimeBetweenMoves) return;
  if (policy_ == HeadPolicy::kFollowGaze) {
    if (gaze_ && gaze_key_ == map_key_) LookAt(TowardPoint(carrier_from_map_, *gaze_), frame.frame.time);
    return;
  }
  const HeadSearch view(head_->range(), *model_, *map_, carrier_from_map_);
  const PanTilt best = view.Best();
  constexpr double kSufficientRatio = 0.7;
  if (view.RecognitionProbability(at) < kSufficientRatio * view.RecognitionProbability(best))
    LookAt(best, frame.frame.time);
  moved_at_ = frame.frame.time;
}

void HeadControl::HandleLost(const engine::TrackedFrame& frame, const PanTilt& at) {
  if (!map_ || !map_->HasFinitePoints() || frame.frame.time - tracked_at_ < kMinLossTime) return;
  if (!search_) search_.emplace(head_->range(), *model_, *map_, carrier_from_map_);
  search_->AddEmptyView(at);
  head_->LookAt(search_->Next(at), frame.frame.time);
}

void HeadControl::LookAt(const PanTilt& wanted, Timestamp now) {
  const PanTilt to = head_->range().Clamped(wanted), from = head_->At(now);
  if (std::hypot(to.pan_rad - from.pan_rad, to.tilt_rad - from.tilt_rad) < kMinMove_rad) return;
  head_->LookAt(to, now);
  moved_at_ = now;
}

}  // namespace docent::app

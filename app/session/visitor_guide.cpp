// SPDX-License-Identifier: Apache-2.0
#include "app/session/visitor_guide.h"

#include "app/session/route_text.h"
#include "app/session/visitor_strings.h"

namespace docent::app {

void VisitorGuide::Guide(const std::shared_ptr<ShownFrame>& frame, const engine::CameraModel& camera) {
  const bool has_pose = engine::HasPose(frame->tracked.state);
  frame->visitor =
      state_.Update(frame->seconds, has_pose ? frame->shown.map_name : std::string(), frame->shown.hint);
  FindViews(*frame);
  frame->visitor->views = views_;
  if (!views_.empty()) frame->visitor->sentence = visitor_strings::kGoToAView;
  if (route_ != nullptr) FollowRoute(frame.get());
  if (has_pose && frame->shown.scene)
    frame->way = FindWay(*frame->shown.scene, camera, frame->tracked.camera_from_map, route_);
  if (frame->way) frame->visitor->way_on = frame->way->drawn;
  if (has_pose) {
    last_with_pose_ = frame;
  } else if (last_with_pose_ && state_.HoldsContent(frame->seconds)) {
    frame->held_camera_from_map = last_with_pose_->tracked.camera_from_map;
    frame->shown.scene = last_with_pose_->shown.scene;
    frame->shown.surfaces = last_with_pose_->shown.surfaces;
  } else {
    last_with_pose_.reset();
  }
}

void VisitorGuide::FollowRoute(ShownFrame* frame) {
  if (engine::HasPose(frame->tracked.state)) {
    route_->Enter(frame->tracked.map_key, frame->seconds);
  } else {
    route_->Leave();
  }
  ui::VisitorDisplay& display = *frame->visitor;
  display.route_line = RouteLine(*route_);
  display.route_stops = RouteList(*route_);
  // Who is lost finds among the stops those that are near.
  if (!display.stops.empty()) display.stops = display.route_stops;
}

// Once a second while the visitor searches.
void VisitorGuide::FindViews(const ShownFrame& frame) {
  constexpr double kInterval_s = 1;
  constexpr std::size_t kMostViews = 3;
  if (!state_.WantsViews(frame.seconds)) {
    views_.clear();
    views_time_s_.reset();
  } else if (!views_time_s_ || frame.seconds - *views_time_s_ >= kInterval_s) {
    views_.clear();
    for (const auto& view : session_->SimilarViews(frame.tracked.frame, kMostViews))
      views_.push_back(view.image);
    views_time_s_ = frame.seconds;
  }
}

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#include "app/session/visitor_guide.h"

#include "app/session/route_text.h"

namespace docent::app {

namespace {

// Such an image says nothing about the visitor, not even that the camera sees nothing.
bool IsSkipped(const ShownFrame& frame) {
  return frame.tracked.state == engine::TrackingState::kDropped;
}

}  // namespace

void VisitorGuide::Guide(const std::shared_ptr<ShownFrame>& frame, const engine::CameraModel& camera) {
  const bool has_pose = claim_.Update(frame->seconds, frame->tracked.state, frame->tracked.map_key);
  if (!has_pose && engine::HasPose(frame->tracked.state)) frame->shown.scene.reset();
  const std::string hint = VisitorHint(frame->shown.rejection, frame->tracked.hint, strings_);
  frame->visitor = state_.Update(frame->seconds, has_pose ? frame->shown.map_name : std::string(), hint);
  FindViews(*frame);
  frame->visitor->views = views_;
  // A visitor who is nearly recognized is not to go elsewhere.
  const bool says_little = hint.empty() || hint == strings_.not_recognized;
  if (!views_.empty() && says_little && !state_.Welcomes(frame->seconds))
    frame->visitor->sentence = strings_.go_to_a_view;
  if (route_ != nullptr) FollowRoute(has_pose, frame.get());
  if (has_pose && frame->shown.scene)
    frame->way = FindWay(*frame->shown.scene, camera, frame->tracked.camera_from_map, route_, strings_);
  if (frame->way) frame->visitor->way_on = frame->way->drawn;
  if (!IsSkipped(*frame)) cards_.Update(camera, frame.get());
  std::optional<Eigen::Vector3d> place;
  if (has_pose && frame->shown.scene) place = frame->tracked.camera_from_map.OriginInSource();
  static const content::Scene kNoScene;
  frame->animation_starts = approach_.Update(frame->seconds, frame->tracked.map_key,
                                             frame->shown.scene ? *frame->shown.scene : kNoScene, place);
  if (has_pose) {
    last_with_pose_ = frame;
  } else if (last_with_pose_ && state_.HoldsContent(frame->seconds)) {
    frame->held_camera_from_map = last_with_pose_->tracked.camera_from_map;
    frame->shown.scene = last_with_pose_->shown.scene;
    frame->shown.surfaces = last_with_pose_->shown.surfaces;
    frame->shown.occluders = last_with_pose_->shown.occluders;
    frame->shown.light = last_with_pose_->shown.light;
    frame->shown.room_light = last_with_pose_->shown.room_light;
  } else {
    last_with_pose_.reset();
  }
}

std::string VisitorHint(const RejectionMessage& rejection, engine::Hint hint, const VisitorStrings& strings) {
  if (rejection.reason != engine::RejectionReason::kNone) return TextOf(rejection, strings);
  switch (hint) {
    case engine::Hint::kMoveMoreSlowly:
      return strings.more_slowly;
    case engine::Hint::kLowTexture:
      return strings.little_detail;
    case engine::Hint::kLeftMap:
      return strings.left_the_map;
    case engine::Hint::kLookBack:
      return strings.look_back;
    case engine::Hint::kFollowOtherCamera:
      return strings.other_camera;
    case engine::Hint::kNone:
    case engine::Hint::kChooseMap:
    case engine::Hint::kMoveSideways:
    case engine::Hint::kMoveInsteadOfTurning:
    case engine::Hint::kMoveFurther:
    case engine::Hint::kAvoidPlane:
    case engine::Hint::kFindMoreDetail:
    case engine::Hint::kWaitUntilStill:
    case engine::Hint::kStartWhereThereIsDetail:
    case engine::Hint::kFindTarget:
    case engine::Hint::kWaitForMap:
      break;
  }
  return {};
}

void VisitorGuide::FollowRoute(bool has_pose, ShownFrame* frame) {
  // Not the frame's `seconds`, which count from the first image of its own camera.
  const double seconds = ToSeconds(frame->tracked.frame.time);
  if (has_pose) {
    route_->Enter(frame->tracked.map_key, seconds, frame->tracked.frame.camera);
  } else if (!IsSkipped(*frame)) {
    route_->Leave(seconds, frame->tracked.frame.camera);
  }
  ui::VisitorDisplay& display = *frame->visitor;
  display.route_line = RouteLine(*route_, strings_);
  display.route_stops = RouteList(*route_, strings_);
  // The end is said where it is not overlooked, and stays in the corner after that.
  constexpr double kEndSaid_s = 8;
  if (route_->Target()) finished_s_.reset();
  // A visitor who searches for a known place is helped first; other hints can wait.
  if (!route_->Target() && !display.is_searching) {
    if (!finished_s_) finished_s_ = frame->seconds;
    if (frame->seconds - *finished_s_ < kEndSaid_s) display.sentence = display.route_line;
  }
  // A visitor who is lost finds among the stops those that are near.
  if (!display.stops.empty()) display.stops = display.route_stops;
}

// Once a second while the visitor searches. Images that were skipped are not there to be compared.
void VisitorGuide::FindViews(const ShownFrame& frame) {
  constexpr double kInterval_s = 1;
  constexpr std::size_t kMostViews = 3;
  const bool entrances = state_.WantsEntrances(frame.seconds);
  if (!entrances && !state_.WantsViews(frame.seconds)) {
    views_.clear();
    views_time_s_.reset();
  } else if (!frame.tracked.frame.image.empty() &&
             (!views_time_s_ || frame.seconds - *views_time_s_ >= kInterval_s)) {
    views_.clear();
    for (Session::SimilarView& view : session_->SimilarViews(frame.tracked.frame, kMostViews, entrances))
      views_.push_back({std::move(view.image), std::move(view.map_name)});
    views_time_s_ = frame.seconds;
  }
}

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#include "app/session/visitor_guide.h"

namespace docent::app {

void VisitorGuide::Guide(const std::shared_ptr<ShownFrame>& frame) {
  const bool has_pose = engine::HasPose(frame->tracked.state);
  frame->visitor =
      state_.Update(frame->seconds, has_pose ? frame->shown.map_name : std::string(), frame->shown.hint);
  FindViews(*frame);
  frame->visitor->views = views_;
  if (!views_.empty()) frame->visitor->sentence = "Go to where you see one of these.";
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

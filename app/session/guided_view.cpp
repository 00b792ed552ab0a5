// SPDX-License-Identifier: Apache-2.0
#include "app/session/guided_view.h"

#include <algorithm>

namespace docent::app {

void ShowWithoutPose(const engine::Frame& image, ShownFrame* frame) {
  frame->seconds += ToSeconds(image.time - frame->tracked.frame.time);
  frame->taken.reset();
  frame->tracked = engine::TrackedFrame();
  frame->tracked.frame = image;
  frame->tracked.state = engine::TrackingState::kLost;
  frame->held_camera_from_map.reset();
  frame->shown.scene.reset();
  frame->shown.surfaces.reset();
  frame->way.reset();
  if (!frame->visitor) return;
  frame->visitor->way_on.reset();
  frame->visitor->targets.clear();
  frame->visitor->marked.reset();
  frame->visitor->dwell.reset();
}

ui::View ViewOf(const ShownFrame& frame, const engine::CameraModel& camera) {
  ui::View view;
  view.tracked = &frame.tracked;
  view.camera = frame.camera ? frame.camera.get() : &camera;
  view.scene = frame.shown.scene.get();
  view.surfaces = frame.shown.surfaces;
  view.occluders = frame.shown.occluders;
  view.light = frame.shown.light.get();
  view.shadows = view.follows_exposure = view.follows_degradation = frame.shown.room_light;
  view.animation_seconds = frame.seconds;
  view.animation_starts = frame.animation_starts.get();
  view.overlay.map_name = frame.shown.map_name;
  view.overlay.is_waiting =
      frame.tracked.state == engine::TrackingState::kInitializing && frame.shown.starting_map.empty();
  if (frame.shown.mapping) view.overlay.mapping = ToString(*frame.shown.mapping);
  if (!frame.shown.starting_map.empty())
    view.overlay.starting_progress = frame.tracked.initialization_progress;
  view.overlay.message = frame.message;
  view.overlay.caption = frame.caption;
  view.overlay.hint = frame.shown.hint;
  view.overlay.visitor = frame.visitor;
  if (frame.held_camera_from_map) view.held_camera_from_map = &*frame.held_camera_from_map;
  return view;
}

void AddOther(const ShownFrame& other, const engine::CameraModel& camera, const VisitorStrings& strings,
              ui::View* view) {
  ui::Overlay& overlay = view->overlay;
  overlay.inset = &other.tracked;
  overlay.inset_scene = other.shown.scene.get();
  overlay.inset_camera = other.camera ? other.camera.get() : &camera;
  const bool is_somewhere = engine::HasPose(other.tracked.state) && !other.shown.map_name.empty();
  overlay.inset_text =
      is_somewhere ? Filled(strings, strings.other_is_at, {other.shown.map_name}) : strings.other_is_lost;
}

void ViewRecorder::Write(const cv::Mat& image, std::uint64_t index) {
  // A longer gap (a device that was unplugged) is not filled with repeated images.
  constexpr std::uint64_t kLongestGap = 300;
  if (last_index_ && index > *last_index_ + 1) {
    const std::uint64_t missing = std::min(index - *last_index_ - 1, kLongestGap);
    for (std::uint64_t i = 0; i < missing; ++i) recorder_.Write(cv::Mat());
  }
  recorder_.Write(image);
  last_index_ = index;
}

}  // namespace docent::app

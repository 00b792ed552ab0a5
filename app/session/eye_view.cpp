// SPDX-License-Identifier: Apache-2.0
#include "app/session/eye_view.h"

namespace docent::app {

namespace {

// The pose that the content is drawn from in the camera's view; empty for none.
std::optional<engine::Rigid3> PoseOf(const ui::View& view) {
  if (view.tracked != nullptr && engine::HasPose(view.tracked->state)) return view.tracked->camera_from_map;
  if (view.held_camera_from_map != nullptr) return *view.held_camera_from_map;
  return std::nullopt;
}

}  // namespace

void MakeEyeView(const ui::View& view, const ShownFrame& frame, const DisplayEye& eye, EyeView* eye_view) {
  ui::View& seen = eye_view->view;
  seen = view;
  seen.camera = &eye.camera;
  seen.shows_video = false;
  seen.overlay.points = seen.overlay.keyframes = false;
  seen.overlay.inset = nullptr;
  eye_view->eye_from_map.reset();
  if (const auto camera_from_map = PoseOf(view)) {
    const double metres_per_unit = view.scene != nullptr ? view.scene->settings.metres_per_unit : 0;
    engine::Rigid3 eye_from_camera = eye.eye_from_camera;
    if (metres_per_unit > 0) {
      eye_from_camera.translation /= metres_per_unit;
    } else {
      eye_from_camera.translation.setZero();
    }
    eye_view->eye_from_map = eye_from_camera * *camera_from_map;
  }
  seen.seen_from_map = eye_view->eye_from_map ? &*eye_view->eye_from_map : nullptr;
  if (!seen.overlay.visitor) return;
  ui::VisitorDisplay& visitor = *seen.overlay.visitor;
  // These are places in the camera's image.
  visitor.targets.clear();
  visitor.marked.reset();
  visitor.has_menu_button = false;
  visitor.way_on.reset();
  if (!frame.way) return;
  constexpr double kMargin = 0.04;  // As FindWay.
  const auto arrow = ui::ArrowTowards(eye.camera, eye.eye_from_camera.rotation * frame.way->towards,
                                      kMargin * eye.camera.width_px());
  if (arrow) visitor.way_on = ui::WayOn{*arrow, frame.way->drawn.text};
}

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "app/calibration/display_file.h"
#include "app/session/guided_view.h"

namespace docent::app {

// What one eye sees through a worn display: the content where it belongs in the room, on black, which such a
// display shows as nothing.
struct EyeView {
  ui::View view;
  std::optional<engine::Rigid3> eye_from_map;  // The view points to it.

  EyeView() = default;
  EyeView(const EyeView&) = delete;
  EyeView& operator=(const EyeView&) = delete;
};

// Makes *eye_view from the view of the camera, which must be that of the frame. Without the scale of the map,
// both eyes see the content from where the camera is.
void MakeEyeView(const ui::View& view, const ShownFrame& frame, const DisplayEye& eye, EyeView* eye_view);

}  // namespace docent::app

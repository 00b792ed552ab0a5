// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/placing_tool.h"

#include <utility>

#include "app/session/surface_at_pixel.h"
#include "engine/base/error.h"
#include "ui/strings.h"

namespace docent::app {

PlaceOccluder OccluderAt(const ui::AuthoringChoices& choices, const Eigen::Vector2d& pixel) {
  PlaceOccluder command;
  command.shape = choices.occluder_shape;
  command.points = {{Eigen::Vector3d::Zero(), pixel}};
  command.upright = choices.occluder_shape == content::Occluder::Shape::kPlane;
  return command;
}

std::optional<Command> PlacingTool::Click(const AuthorView& view, const ui::AuthoringChoices& choices,
                                          const Eigen::Vector2d& pixel, const std::string& trail,
                                          std::string* note) {
  using Tool = ui::AuthoringTool;
  const auto refuse = [&](const char* why) {
    *note = why;
    return std::optional<Command>();
  };
  switch (choices.tool) {
    case Tool::kSelect:
      return std::nullopt;
    case Tool::kModel: {
      if (choices.model_file.empty()) return refuse(ui::strings::kChooseFile);
      PlaceModel command{choices.model_file, pixel, std::nullopt, choices.yaw_deg};
      if (!choices.automatic_size) command.scale = choices.scale;
      return command;
    }
    case Tool::kSignpost:
      if (choices.sign_text.empty()) return refuse(ui::strings::kWriteText);
      return PlaceSignpost{choices.sign_text, pixel, choices.sign_to_map};
    case Tool::kLabel:
      if (choices.label_text.empty()) return refuse(ui::strings::kWriteText);
      return PlaceLabel{choices.label_text, pixel};
    case Tool::kImage:
      if (choices.image_file.empty()) return refuse(ui::strings::kChooseImage);
      return PlaceImage{choices.image_file, pixel, std::nullopt, choices.image_upright};
    case Tool::kSound:
      if (choices.sound_file.empty()) return refuse(ui::strings::kChooseSound);
      if (choices.caption.empty()) return refuse(ui::strings::kWriteCaption);
      return PlaceSound{choices.sound_file, choices.caption, pixel};
    case Tool::kTrail:
      return ClickTrail(view, pixel, trail, note);
    case Tool::kOccluder:
      return OccluderAt(choices, pixel);
  }
  return std::nullopt;
}

std::optional<Command> PlacingTool::ClickTrail(const AuthorView& view, const Eigen::Vector2d& pixel,
                                               const std::string& trail, std::string* note) {
  if (trail_begin_) {
    PlaceTrail command;
    command.points = {{*trail_begin_, std::nullopt}, {Eigen::Vector3d::Zero(), pixel}};
    trail_begin_.reset();
    return command;
  }
  if (!trail.empty()) return ExtendTrail{trail, {Eigen::Vector3d::Zero(), pixel}};
  if (!view.has_pose()) return std::nullopt;
  // The next click may come with another frame, so that a pixel of this one would mean another point.
  try {
    trail_begin_ = SurfaceAtPixel(view.frame->tracked, view.camera.lens, pixel).point;
    *note = ui::strings::kTrailBegun;
  } catch (const Error&) {
    *note = ui::strings::kNoSurface;
  }
  return std::nullopt;
}

bool PlacingTool::Cancel() {
  return std::exchange(trail_begin_, std::nullopt).has_value();
}

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#include "ui/heads_up.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "ui/figures.h"
#include "ui/theme.h"
#include "ui/visitor_display.h"

namespace docent::ui {
namespace {

using engine::TrackingState;

using theme::kFair, theme::kGood, theme::kPoor;
constexpr Color kPanel = theme::kHeadsUp, kInk = theme::kText;

const char* StateText(TrackingState state) {
  switch (state) {
    case TrackingState::kInitializing:
      return "Starting the map…";
    case TrackingState::kSixDof:
      return "Tracking";
    case TrackingState::kHybrid:
      return "Tracking";
    case TrackingState::kPanorama:
      return "Tracking the direction only";
    case TrackingState::kLost:
      return "Lost";
    case TrackingState::kRelocalized:
      return "Place recognized";
    case TrackingState::kDropped:
      return "Image skipped";
  }
  return "";
}

// The sentence for a mapping status of the session; any other text is shown unchanged.
std::string MappingText(const std::string& mapping) {
  if (mapping == "limited") return "Can't extend the map here";
  if (mapping == "extending") return "Extending the map";
  if (mapping == "mapped") return "This view is complete";
  return mapping;
}

Color QualityColor(engine::TrackingQuality quality) {
  switch (quality) {
    case engine::TrackingQuality::kGood:
      return kGood;
    case engine::TrackingQuality::kPoor:
      return kFair;
    case engine::TrackingQuality::kLost:
      return kPoor;
  }
  return kPoor;
}

void DrawStatus(const View& view, double unit, Canvas* canvas) {
  const engine::TrackedFrame& tracked = *view.tracked;
  const bool named = !view.overlay.map_name.empty();
  TextStyle name_style, state_style;
  name_style.size_px = 17 * unit;
  name_style.bold = true;
  name_style.max_width_px = std::max(40, static_cast<int>(0.55 * canvas->width_px()));
  name_style.max_height_px = static_cast<int>(30 * unit);
  name_style.color = kInk;
  state_style = name_style;
  state_style.bold = !named;
  state_style.size_px = (named ? 13 : 17) * unit;

  std::string state = view.overlay.is_waiting ? "No map yet" : StateText(tracked.state);
  // During initialization the state already says this.
  if (!view.overlay.mapping.empty() && tracked.state != TrackingState::kInitializing)
    state += " · " + MappingText(view.overlay.mapping);
  const Eigen::Vector2d name_size = canvas->Measure(view.overlay.map_name, name_style);
  const Eigen::Vector2d state_size = canvas->Measure(state, state_style);
  const double padding = 8 * unit, dot = 5 * unit;
  const double text_width = std::max({name_size.x(), state_size.x(), 90 * unit});
  const double left = 10 * unit, top = 10 * unit;
  const double text_left = left + 2 * padding + 2 * dot;
  const double height = name_size.y() + state_size.y() + 2 * padding + 8 * unit;
  canvas->Box({left, top}, {text_left + text_width + padding, top + height}, 9 * unit, kPanel);
  const bool has_pose = engine::HasPose(tracked.state);
  const Color color = has_pose ? QualityColor(tracked.quality_class) : kPoor;
  canvas->Disk({left + padding + dot, top + padding + 0.5 * std::max(name_size.y(), state_size.y())}, dot,
               color);
  if (named) canvas->Text(view.overlay.map_name, name_style, {text_left, top + padding});
  canvas->Text(state, state_style, {text_left, top + padding + name_size.y()});

  const double bar_top = top + height - padding - 2 * unit;
  const double fill =
      has_pose && std::isfinite(tracked.quality) ? std::clamp(tracked.quality, 0.0, 1.0) : 0.0;
  canvas->Box({text_left, bar_top}, {text_left + text_width, bar_top + 4 * unit}, 2 * unit,
              Faded(kInk, 0.25));
  canvas->Box({text_left, bar_top}, {text_left + fill * text_width, bar_top + 4 * unit}, 2 * unit, color);
}

// Draws a straight line of the map, distorted by the lens.
void DrawMapLine(const Eigen::Vector3d& from_in_camera, const Eigen::Vector3d& to_in_camera,
                 const engine::CameraModel& camera, const Color& color, Canvas* canvas) {
  constexpr int kSteps = 6;
  const double reach_px = camera.width_px() + camera.height_px();
  std::optional<Eigen::Vector2d> previous;
  for (int i = 0; i <= kSteps; ++i) {
    const double t = static_cast<double>(i) / kSteps;
    std::optional<Eigen::Vector2d> pixel = camera.Project((1 - t) * from_in_camera + t * to_in_camera);
    if (pixel && !camera.IsInside(*pixel, -reach_px)) pixel.reset();
    if (pixel && previous && (camera.IsInside(*pixel) || camera.IsInside(*previous)))
      canvas->Line(*previous, *pixel, 1.5, color);
    previous = pixel;
  }
}

}  // namespace

Color LevelColor(int level) {
  constexpr std::array<Color, engine::kPyramidLevels> kColors = {
      {{1.0f, 0.35f, 0.30f}, {1.0f, 0.77f, 0.24f}, {0.30f, 0.85f, 0.48f}, {0.30f, 0.64f, 1.0f}}};
  return kColors[std::clamp(level, 0, engine::kPyramidLevels - 1)];
}

void DrawPoints(const engine::TrackedFrame& tracked, Canvas* canvas) {
  for (const engine::PointMatch& match : tracked.matches) {
    const double radius = 2.0 + 1.0 * match.level;
    const Eigen::Vector2d pixel = match.pixel.cast<double>();
    if (match.inlier) {
      canvas->Disk(pixel, radius, LevelColor(match.level));
    } else {
      canvas->Disk(pixel, radius, Faded(LevelColor(match.level), 0.5), 1.0);
    }
  }
}

void DrawKeyFrames(const engine::MapSnapshot& map, const engine::CameraModel& camera,
                   const engine::Rigid3& camera_from_map, Canvas* canvas) {
  for (const engine::KeyFrame& keyframe : map.keyframes) {
    if (keyframe.camera == nullptr) continue;
    const engine::Rigid3 camera_from_keyframe = camera_from_map * keyframe.camera_from_map.inverse();
    const double size = 0.08 * keyframe.mean_depth;
    const Color color = keyframe.kind == engine::KeyFrameKind::kPanorama ? Color{0.75f, 0.55f, 1.0f, 0.9f}
                                                                         : Color{0.55f, 0.9f, 1.0f, 0.9f};
    const double right = keyframe.camera->width_px() - 1, bottom = keyframe.camera->height_px() - 1;
    const std::array<Eigen::Vector2d, 4> pixels = {{{0, 0}, {right, 0}, {right, bottom}, {0, bottom}}};
    std::array<Eigen::Vector3d, 4> corners;
    bool complete = true;
    for (int i = 0; i < 4; ++i) {
      const std::optional<Eigen::Vector3d> ray = keyframe.camera->Unproject(pixels[i]);
      complete = complete && ray.has_value();
      if (ray) corners[i] = camera_from_keyframe * Eigen::Vector3d(size * *ray);
    }
    if (!complete) continue;
    for (int i = 0; i < 4; ++i) {
      DrawMapLine(camera_from_keyframe.translation, corners[i], camera, color, canvas);
      DrawMapLine(corners[i], corners[(i + 1) % 4], camera, color, canvas);
    }
  }
}

HeadsUpStyle HeadsUpStyleFor(int height_px) {
  return {std::clamp(height_px / 480.0, 0.5, 4.0), 0};
}

void DrawHeadsUp(const View& view, const HeadsUpStyle& style, Canvas* canvas) {
  if (view.overlay.visitor) return DrawVisitorDisplay(view, style, canvas);
  const double unit = style.unit_px;
  const double lowest = canvas->height_px() - 12 * unit - style.bottom_px;
  if (view.tracked == nullptr) {
    DrawSentence(view.overlay.message, 15, lowest, unit, canvas);
    return;
  }
  const engine::TrackedFrame& tracked = *view.tracked;
  const bool lost = tracked.state == TrackingState::kLost;
  // Without depth nothing can be placed yet, so the figure covers nothing that is needed.
  const bool starting = (tracked.state == TrackingState::kInitializing && !view.overlay.is_waiting) ||
                        (view.overlay.starting_progress && !lost);
  const Eigen::Vector2d middle(0.5 * (canvas->width_px() - 1), 0.5 * (canvas->height_px() - 1));
  const double radius = 0.11 * std::min(canvas->width_px(), canvas->height_px());
  if (lost) {
    canvas->Box({-1, -1}, {canvas->width_px() + 0.0, canvas->height_px() + 0.0}, 0,
                {0.02f, 0.03f, 0.06f, 0.35f});
    DrawSearchFigure(middle, radius, view.animation_seconds, canvas);
  } else if (starting) {
    DrawMoveFigure(middle, 0.7 * radius, view.animation_seconds, canvas);
    if (view.overlay.starting_progress)
      DrawProgressRing(middle, 1.8 * radius, *view.overlay.starting_progress, canvas);
  }
  if (view.overlay.status) DrawStatus(view, unit, canvas);
  const double bottom = DrawSentence(view.overlay.message, 15, lowest, unit, canvas) - 6 * unit;
  const std::string& hint = view.overlay.hint;
  DrawSentence(hint.empty() && lost ? "Point the camera at a place that is already mapped." : hint, 18,
               bottom, unit, canvas);
}

void DrawInsetFrame(const engine::TrackedFrame& tracked, const Inset& inset, Canvas* canvas) {
  const double stroke = 3 * HeadsUpStyleFor(canvas->height_px()).unit_px;
  const Color color = engine::HasPose(tracked.state) ? QualityColor(tracked.quality_class) : kPoor;
  canvas->Box({inset.x - stroke, inset.y - stroke},
              {inset.x + inset.width - 1 + stroke, inset.y + inset.height - 1 + stroke}, stroke, color,
              stroke);
}

}  // namespace docent::ui

// SPDX-License-Identifier: Apache-2.0
#include "ui/heads_up.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "ui/theme.h"

namespace docent::ui {
namespace {

using engine::TrackingState;

using theme::kFair, theme::kGood, theme::kPoor;
constexpr Color kPanel = theme::kHeadsUp, kInk = theme::kText;
constexpr Color kBeam{1.0f, 0.84f, 0.45f, 1.0f};
constexpr double kPi = std::numbers::pi;

Color Faded(Color color, double alpha) {
  color.alpha *= static_cast<float>(alpha);
  return color;
}

Eigen::Vector2d OnCircle(const Eigen::Vector2d& center, double radius, double angle) {
  return center + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
}

const char* StateText(TrackingState state) {
  switch (state) {
    case TrackingState::kInitializing:
      return "Starting the map…";
    case TrackingState::kSixDof:
      return "Tracking";
    case TrackingState::kHybrid:
      return "Tracking with distant points";
    case TrackingState::kPanorama:
      return "Tracking rotation only";
    case TrackingState::kLost:
      return "Lost";
    case TrackingState::kRelocalized:
      return "Position recovered";
    case TrackingState::kDropped:
      return "Frame skipped";
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
    case engine::TrackingQuality::kBad:
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

// Draws a sentence in a panel whose bottom is at this height. Returns the panel's top.
double DrawSentence(const std::string& text, double units, double bottom, double unit, Canvas* canvas) {
  if (text.empty()) return bottom;
  TextStyle style;
  style.size_px = units * unit;
  style.centered = true;
  style.max_width_px = std::max(40, static_cast<int>(0.84 * canvas->width_px()));
  style.max_height_px = std::max(20, static_cast<int>(0.28 * canvas->height_px()));
  style.color = kInk;
  const Eigen::Vector2d size = canvas->Measure(text, style);
  const Eigen::Vector2d padding(12 * unit, 6 * unit);
  const double middle = 0.5 * (canvas->width_px() - 1);
  const double top = bottom - size.y() - 2 * padding.y();
  canvas->Box({middle - 0.5 * size.x() - padding.x(), top}, {middle + 0.5 * size.x() + padding.x(), bottom},
              8 * unit, kPanel);
  canvas->Text(text, style, {middle, top + padding.y()}, 0.5);
  return top;
}

// The position of the magnifying glass, in units of the dial's radius. The path repeats only after about a
// minute (2 pi / 0.1 s).
Eigen::Vector2d SearchPath(double seconds) {
  return {1.05 * std::sin(1.3 * seconds), 0.55 * std::sin(1.7 * seconds + 0.6)};
}

void DrawSearchFigure(const Eigen::Vector2d& center, double radius, double seconds, Canvas* canvas) {
  canvas->Disk(center, 1.5 * radius, Faded(kPanel, 0.8));
  // The compass: slowly rotating ticks, and a needle that points to the magnifying glass.
  const Eigen::Vector2d lens = center + radius * SearchPath(seconds);
  for (int i = 0; i < 24; ++i) {
    const double angle = 2 * kPi * i / 24 + 0.15 * seconds;
    const bool is_long = i % 6 == 0;
    canvas->Line(OnCircle(center, 1.38 * radius, angle),
                 OnCircle(center, (is_long ? 1.2 : 1.3) * radius, angle), (is_long ? 0.06 : 0.03) * radius,
                 Faded(kInk, is_long ? 0.9 : 0.45));
  }
  const Eigen::Vector2d to_lens = lens - center;
  const double angle = std::atan2(to_lens.y(), to_lens.x());
  canvas->Line(center, OnCircle(center, 1.12 * radius, angle), 0.05 * radius, Faded(kPoor, 0.9));
  canvas->Line(center, OnCircle(center, 0.5 * radius, angle + kPi), 0.05 * radius, Faded(kInk, 0.6));
  canvas->Disk(center, 0.07 * radius, kInk);
  // Fading marks along the glass's past path.
  for (int i = 14; i >= 1; --i) {
    const double age = 0.11 * i;
    canvas->Disk(center + radius * SearchPath(seconds - age), 0.045 * radius,
                 Faded(kBeam, 0.75 * (1.0 - i / 15.0)));
  }
  // The magnifying glass, with a swinging handle and a pulsing glint.
  const double handle = 0.25 * kPi + 0.18 * std::sin(2.1 * seconds);
  canvas->Line(OnCircle(lens, 0.36 * radius, handle), OnCircle(lens, 0.78 * radius, handle), 0.13 * radius,
               {0.62f, 0.40f, 0.22f, 1.0f});
  canvas->Disk(lens, 0.34 * radius, Faded(kBeam, 0.22 + 0.1 * std::sin(3.0 * seconds)));
  canvas->Disk(lens, 0.38 * radius, kInk, 0.075 * radius);
  canvas->Disk(OnCircle(lens, 0.2 * radius, -0.7 * kPi), 0.06 * radius, Faded(kInk, 0.85));
}

void DrawMoveFigure(const Eigen::Vector2d& center, double radius, double seconds, Canvas* canvas) {
  canvas->Box(center - Eigen::Vector2d(1.9, 0.85) * radius, center + Eigen::Vector2d(1.9, 0.85) * radius,
              0.35 * radius, Faded(kPanel, 0.8));
  const double glide = std::sin(1.6 * seconds);
  for (const double side : {-1.0, 1.0}) {  // The arrow in the direction of motion is brighter.
    const double shine = std::clamp(0.35 + 0.65 * side * std::cos(1.6 * seconds), 0.15, 1.0);
    const Eigen::Vector2d tip = center + Eigen::Vector2d(1.7 * side * radius, 0);
    for (const double leg : {-1.0, 1.0})
      canvas->Line(tip, tip + Eigen::Vector2d(-0.25 * side, 0.25 * leg) * radius, 0.1 * radius,
                   Faded(kBeam, shine));
  }
  const Eigen::Vector2d body = center + Eigen::Vector2d(0.75 * glide * radius, 0);
  const Eigen::Vector2d half(0.5 * radius, 0.34 * radius);
  canvas->Box(body - half - Eigen::Vector2d(-0.2, 0.1) * radius, body + Eigen::Vector2d(0.0, -0.2) * radius,
              0.06 * radius, kInk);
  canvas->Box(body - half, body + half, 0.1 * radius, kInk);
  canvas->Disk(body, 0.24 * radius, {0.1f, 0.14f, 0.2f, 1.0f});
  canvas->Disk(body, 0.16 * radius, Faded(kBeam, 0.5 + 0.3 * glide));
}

// A ring that fills clockwise from the top.
void DrawProgressRing(const Eigen::Vector2d& center, double radius, double progress, Canvas* canvas) {
  constexpr int kParts = 72;
  const int filled = static_cast<int>(std::lround(kParts * std::clamp(progress, 0.0, 1.0)));
  canvas->Disk(center, radius, Faded(kPanel, 0.8), 0.2 * radius);
  for (int i = 0; i < filled; ++i) {
    const double from = 2 * kPi * i / kParts - 0.5 * kPi, to = 2 * kPi * (i + 1) / kParts - 0.5 * kPi;
    canvas->Line(OnCircle(center, radius, from), OnCircle(center, radius, to), 0.1 * radius,
                 i + 1 == kParts ? kGood : kBeam);
  }
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

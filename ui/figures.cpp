// SPDX-License-Identifier: Apache-2.0
#include "ui/figures.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ui/theme.h"

namespace docent::ui {

namespace {

using theme::kGood, theme::kPoor;
constexpr Color kFigurePanel = theme::kHeadsUp, kFigureInk = theme::kText;
constexpr Color kFigureBeam{1.0f, 0.84f, 0.45f, 1.0f};
constexpr double kFigurePi = std::numbers::pi;

Eigen::Vector2d OnCircle(const Eigen::Vector2d& center, double radius, double angle) {
  return center + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
}

// The position of the magnifying glass, in units of the dial's radius. The path repeats only after about a
// minute (2 pi / 0.1 s).
Eigen::Vector2d SearchPath(double seconds) {
  return {1.05 * std::sin(1.3 * seconds), 0.55 * std::sin(1.7 * seconds + 0.6)};
}

// In units.
constexpr double kSentencePaddingX = 12, kSentencePaddingY = 6;

TextStyle SentenceStyle(double units, double unit, const Canvas& canvas) {
  TextStyle style;
  style.size_px = units * unit;
  style.centered = true;
  style.max_width_px = std::max(40, static_cast<int>(0.84 * canvas.width_px()));
  style.max_height_px = std::max(20, static_cast<int>(0.28 * canvas.height_px()));
  style.color = kFigureInk;
  return style;
}

}  // namespace

Color Faded(Color color, double alpha) {
  color.alpha *= static_cast<float>(alpha);
  return color;
}

Eigen::AlignedBox2d SentencePanel(const std::string& text, double units, double bottom, double unit,
                                  Canvas* canvas) {
  if (text.empty()) return {};
  const Eigen::Vector2d size = canvas->Measure(text, SentenceStyle(units, unit, *canvas));
  const Eigen::Vector2d half(0.5 * size.x() + kSentencePaddingX * unit,
                             size.y() + 2 * kSentencePaddingY * unit);
  const double middle = 0.5 * (canvas->width_px() - 1);
  return {Eigen::Vector2d(middle - half.x(), bottom - half.y()), Eigen::Vector2d(middle + half.x(), bottom)};
}

double DrawSentence(const std::string& text, double units, double bottom, double unit, Canvas* canvas) {
  if (text.empty()) return bottom;
  const Eigen::AlignedBox2d panel = SentencePanel(text, units, bottom, unit, canvas);
  canvas->Box(panel.min(), panel.max(), 8 * unit, kFigurePanel);
  canvas->Text(text, SentenceStyle(units, unit, *canvas),
               {panel.center().x(), panel.min().y() + kSentencePaddingY * unit}, 0.5);
  return panel.min().y();
}

void DrawSearchFigure(const Eigen::Vector2d& center, double radius, double seconds, Canvas* canvas) {
  canvas->Disk(center, 1.5 * radius, Faded(kFigurePanel, 0.8));
  // The compass: slowly rotating ticks, and a needle that points to the magnifying glass.
  const Eigen::Vector2d lens = center + radius * SearchPath(seconds);
  for (int i = 0; i < 24; ++i) {
    const double angle = 2 * kFigurePi * i / 24 + 0.15 * seconds;
    const bool is_long = i % 6 == 0;
    canvas->Line(OnCircle(center, 1.38 * radius, angle),
                 OnCircle(center, (is_long ? 1.2 : 1.3) * radius, angle), (is_long ? 0.06 : 0.03) * radius,
                 Faded(kFigureInk, is_long ? 0.9 : 0.45));
  }
  const Eigen::Vector2d to_lens = lens - center;
  const double angle = std::atan2(to_lens.y(), to_lens.x());
  canvas->Line(center, OnCircle(center, 1.12 * radius, angle), 0.05 * radius, Faded(kPoor, 0.9));
  canvas->Line(center, OnCircle(center, 0.5 * radius, angle + kFigurePi), 0.05 * radius,
               Faded(kFigureInk, 0.6));
  canvas->Disk(center, 0.07 * radius, kFigureInk);
  // Fading marks along the glass's past path.
  for (int i = 14; i >= 1; --i) {
    const double age = 0.11 * i;
    canvas->Disk(center + radius * SearchPath(seconds - age), 0.045 * radius,
                 Faded(kFigureBeam, 0.75 * (1.0 - i / 15.0)));
  }
  // The magnifying glass, with a swinging handle and a pulsing glint.
  const double handle = 0.25 * kFigurePi + 0.18 * std::sin(2.1 * seconds);
  canvas->Line(OnCircle(lens, 0.36 * radius, handle), OnCircle(lens, 0.78 * radius, handle), 0.13 * radius,
               {0.62f, 0.40f, 0.22f, 1.0f});
  canvas->Disk(lens, 0.34 * radius, Faded(kFigureBeam, 0.22 + 0.1 * std::sin(3.0 * seconds)));
  canvas->Disk(lens, 0.38 * radius, kFigureInk, 0.075 * radius);
  canvas->Disk(OnCircle(lens, 0.2 * radius, -0.7 * kFigurePi), 0.06 * radius, Faded(kFigureInk, 0.85));
}

void DrawMoveFigure(const Eigen::Vector2d& center, double radius, double seconds, Canvas* canvas) {
  canvas->Box(center - Eigen::Vector2d(1.9, 0.85) * radius, center + Eigen::Vector2d(1.9, 0.85) * radius,
              0.35 * radius, Faded(kFigurePanel, 0.8));
  const double glide = std::sin(1.6 * seconds);
  for (const double side : {-1.0, 1.0}) {  // The arrow in the direction of motion is brighter.
    const double shine = std::clamp(0.35 + 0.65 * side * std::cos(1.6 * seconds), 0.15, 1.0);
    const Eigen::Vector2d tip = center + Eigen::Vector2d(1.7 * side * radius, 0);
    for (const double leg : {-1.0, 1.0})
      canvas->Line(tip, tip + Eigen::Vector2d(-0.25 * side, 0.25 * leg) * radius, 0.1 * radius,
                   Faded(kFigureBeam, shine));
  }
  const Eigen::Vector2d body = center + Eigen::Vector2d(0.75 * glide * radius, 0);
  const Eigen::Vector2d half(0.5 * radius, 0.34 * radius);
  canvas->Box(body - half - Eigen::Vector2d(-0.2, 0.1) * radius, body + Eigen::Vector2d(0.0, -0.2) * radius,
              0.06 * radius, kFigureInk);
  canvas->Box(body - half, body + half, 0.1 * radius, kFigureInk);
  canvas->Disk(body, 0.24 * radius, {0.1f, 0.14f, 0.2f, 1.0f});
  canvas->Disk(body, 0.16 * radius, Faded(kFigureBeam, 0.5 + 0.3 * glide));
}

void DrawProgressRing(const Eigen::Vector2d& center, double radius, double progress, Canvas* canvas) {
  constexpr int kParts = 72;
  const int filled = static_cast<int>(std::lround(kParts * std::clamp(progress, 0.0, 1.0)));
  canvas->Disk(center, radius, Faded(kFigurePanel, 0.8), 0.2 * radius);
  for (int i = 0; i < filled; ++i) {
    const double from = 2 * kFigurePi * i / kParts - 0.5 * kFigurePi,
                 to = 2 * kFigurePi * (i + 1) / kParts - 0.5 * kFigurePi;
    canvas->Line(OnCircle(center, radius, from), OnCircle(center, radius, to), 0.1 * radius,
                 i + 1 == kParts ? kGood : kFigureBeam);
  }
}

}  // namespace docent::ui

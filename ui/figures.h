// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <string>

#include "ui/canvas.h"

// Animated figures and sentences of the 2D layers. Lengths are pixels of the canvas; pure functions of their
// arguments, so that the same time always gives the same image.
namespace docent::ui {

// The color with this share of its opacity.
Color Faded(Color color, double alpha);

// Where DrawSentence draws its panel; empty for an empty sentence.
Eigen::AlignedBox2d SentencePanel(const std::string& text, double units, double bottom, double unit,
                                  Canvas* canvas);
// Draws a centred sentence in a panel whose bottom is at this height, and nothing for an empty one. `units`
// is the text's size in units of `unit` pixels. Returns the panel's top.
double DrawSentence(const std::string& text, double units, double bottom, double unit, Canvas* canvas);

// A magnifying glass over a compass, which asks to look around.
void DrawSearchFigure(const Eigen::Vector2d& center, double radius, double seconds, Canvas* canvas);
// A camera that moves sideways.
void DrawMoveFigure(const Eigen::Vector2d& center, double radius, double seconds, Canvas* canvas);
// A ring that fills clockwise from the top; progress is from 0 to 1.
void DrawProgressRing(const Eigen::Vector2d& center, double radius, double progress, Canvas* canvas);

}  // namespace docent::ui

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "ui/heads_up.h"
#include "ui/inset.h"

namespace docent::ui {

// Where the images of `visitor.views` lie in an image of this size, in its pixels.
std::vector<Inset> PlaceViews(const VisitorDisplay& visitor, int width_px, int height_px);

// The parts of the canvas that DrawVisitorDisplay needs for lasting texts and for its button: place, tour,
// sentence and message.
std::vector<Eigen::AlignedBox2d> TakenByVisitorDisplay(const View& view, const HeadsUpStyle& style,
                                                       Canvas* canvas);

// Draws what a visitor is told (Overlay::visitor) with the view's message, and nothing of the state of
// tracking. Keeps no state.
void DrawVisitorDisplay(const View& view, const HeadsUpStyle& style, Canvas* canvas);

}  // namespace docent::ui

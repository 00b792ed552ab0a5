// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "ui/heads_up.h"
#include "ui/inset.h"

namespace docent::ui {

// Where the images of `visitor.views` lie in an image of this size, in its pixels.
std::vector<Inset> PlaceViews(const VisitorDisplay& visitor, int width_px, int height_px);

// Draws what a visitor is told (Overlay::visitor) with the view's message, and nothing of the state of
// tracking. Keeps no state.
void DrawVisitorDisplay(const View& view, const HeadsUpStyle& style, Canvas* canvas);

}  // namespace docent::ui

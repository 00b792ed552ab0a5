// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "ui/heads_up.h"

namespace docent::ui {

// Draws what a visitor is told (Overlay::visitor) with the view's message, and nothing of the state of
// tracking. Keeps no state.
void DrawVisitorDisplay(const View& view, const HeadsUpStyle& style, Canvas* canvas);

}  // namespace docent::ui

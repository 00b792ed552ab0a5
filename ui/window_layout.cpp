// SPDX-License-Identifier: Apache-2.0
#include "ui/window_layout.h"

#include <algorithm>
#include <cmath>

namespace docent::ui {

WindowLayout LayOutWindow(double width, double height, double wanted_scale, bool panel_open) {
  constexpr double kPanelWidth = 320, kStripWidth = 30, kLargestShare = 0.45, kMinScale = 0.75;
  WindowLayout layout;
  const double fitting = std::min(width / kMinWindowWidth, height / kMinWindowHeight);
  layout.scale = std::max(kMinScale, std::min(wanted_scale, fitting));
  layout.panel_open = panel_open;
  const double wanted = panel_open ? std::min(kPanelWidth * layout.scale,
                                              std::max(kLargestShare * width, kPanelWidth * kMinScale))
                                   : kStripWidth * layout.scale;
  const double panel_width = std::floor(std::clamp(wanted, 0.0, width - 1));
  layout.panel = {width - panel_width, 0, panel_width, height};
  layout.image = {0, 0, width - panel_width, height};
  return layout;
}

}  // namespace docent::ui

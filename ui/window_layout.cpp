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

Area PlaceSmallMap(const Area& shown_image, const Area& inset, double scale) {
  constexpr double kShare = 0.28, kMargin = 0.015;  // As the second camera's image; see inset.h.
  constexpr double kAspect = 4.0 / 3.0, kLeastHeight = 60;
  const double margin = kMargin * shown_image.width;
  Area area;
  area.width = kShare * shown_image.width;
  area.height = area.width / kAspect;
  area.x = shown_image.right() - margin - area.width;
  area.y = (inset.height > 0 ? inset.bottom() : shown_image.y) + margin;
  // The lower third belongs to the sentences.
  area.height = std::min(area.height, shown_image.y + 0.67 * shown_image.height - area.y);
  if (area.height < kLeastHeight * scale) return {};
  return area;
}

}  // namespace docent::ui

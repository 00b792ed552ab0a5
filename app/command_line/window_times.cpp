// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/window_times.h"

#include <cstdio>

namespace docent::app {

void WindowTimes::Add(Part part) {
  const Clock::time_point now = Clock::now();
  times_[static_cast<std::size_t>(part)].Add(now - last_);
  last_ = now;
}

std::string WindowTimes::Summary() const {
  constexpr std::array<const char*, 5> kNames = {"input", "image", "present", "interface", "show"};
  std::string summary =
      "window: " + std::to_string(times_.front().count()) + " frames; median and 95th percentile in ms";
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    char part[80];
    std::snprintf(part, sizeof part, "%s %s %.2f %.2f", i == 0 ? ":" : ",", kNames[i],
                  times_[i].Quantile_ms(0.5), times_[i].Quantile_ms(0.95));
    summary += part;
  }
  return summary;
}

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/window_times.h"

#include <algorithm>
#include <cstdio>

namespace docent::app {

namespace {

constexpr std::size_t kMostWindowFrames = 100'000;  // About half an hour.

float RankedTime(std::vector<float> times_ms, double share) {
  if (times_ms.empty()) return 0;
  const auto rank = static_cast<std::ptrdiff_t>(share * static_cast<double>(times_ms.size() - 1));
  std::nth_element(times_ms.begin(), times_ms.begin() + rank, times_ms.end());
  return times_ms[static_cast<std::size_t>(rank)];
}

}  // namespace

void WindowTimes::Add(Part part) {
  const Clock::time_point now = Clock::now();
  std::vector<float>& times_ms = times_ms_[static_cast<std::size_t>(part)];
  if (times_ms.size() < kMostWindowFrames)
    times_ms.push_back(std::chrono::duration<float, std::milli>(now - last_).count());
  last_ = now;
}

std::string WindowTimes::Summary() const {
  constexpr std::array<const char*, 5> kNames = {"input", "image", "present", "interface", "show"};
  std::string summary =
      "window: " + std::to_string(times_ms_.front().size()) + " frames; median and 95th percentile in ms";
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    char part[80];
    std::snprintf(part, sizeof part, "%s %s %.2f %.2f", i == 0 ? ":" : ",", kNames[i],
                  RankedTime(times_ms_[i], 0.5), RankedTime(times_ms_[i], 0.95));
    summary += part;
  }
  return summary;
}

}  // namespace docent::app

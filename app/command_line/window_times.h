// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <string>

#include "app/evaluation/duration_histogram.h"

namespace docent::app {

// How long the parts of the window's frames take, for `--verbose`. Drivers queue drawing commands, so that
// one part may wait for the drawing of an earlier one. One thread.
class WindowTimes {
 public:
  // Events and commands; image with content; copying it to the window; panel and texts; showing the window.
  enum class Part { kInput, kImage, kPresent, kInterface, kShow };

  // Begins a frame.
  void Start() { last_ = Clock::now(); }
  // The time since the last call of Start or Add was spent on this part.
  void Add(Part part);
  // The number of frames, and median and 95th percentile of each part in milliseconds, as one line.
  std::string Summary() const;

 private:
  using Clock = std::chrono::steady_clock;

  Clock::time_point last_{};
  std::array<DurationHistogram, 5> times_;  // By part.
};

}  // namespace docent::app

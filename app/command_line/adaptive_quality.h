// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "ui/quality_controller.h"
#include "ui/renderer.h"

namespace docent::app {

// Draws as sharp as the window, up to what the machine can do: what is too slow is drawn less well, so that
// the image never freezes. One thread.
class AdaptiveQuality {
 public:
  using Clock = std::chrono::steady_clock;

  // Draws one of everything at every quality, as a driver without a graphics card takes seconds to compile
  // what it has not drawn before, in which a visitor's image would freeze.
  static void WarmUp(ui::Renderer* renderer);
  // Sets the quality of the next image, of which one of the camera's pixels covers this many of the window,
  // and leaves the shadows out of its view where drawing them takes too long.
  void Apply(double pixels_per_pixel, ui::Renderer* renderer, ui::View* view) const;
  // An image was drawn from `begin` to now. Returns what has changed, in words, if anything has.
  std::optional<std::string> Add(Clock::time_point begin, Clock::time_point now);

 private:
  const Clock::time_point start_ = Clock::now();
  ui::QualityController controller_;
};

}  // namespace docent::app

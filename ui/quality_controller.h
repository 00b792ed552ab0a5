// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace docent::ui {

// One quality of drawing.
struct DrawingQuality {
  const char* name;  // For the log.
  int samples;       // See RendererOptions.
  // Of the image that is drawn, relative to that of the camera; the window may need less.
  double largest_scale;
  bool shadows;  // Of the content on the room.
  bool smooth;   // Whether the pixels of the drawn image are interpolated in the window.
};

// From the best to the cheapest. Measured with Mesa's software renderer, in a window of 1280 x 800 with a
// camera of 640 x 480 pixels in the museum of the simulator: an image took 240, 85, 75, 28 and 19 ms of
// processor time with the first five, most of it for shadows, and 4 ms less without smoothing.
inline constexpr std::array<DrawingQuality, 6> kQualityLevels = {{
    {"the resolution of the window", 4, 2.0, true, true},
    {"the resolution of the camera", 4, 1.0, true, true},
    {"without anti-aliasing", 1, 1.0, true, true},
    {"without shadows", 1, 1.0, false, true},
    {"half the resolution of the camera", 1, 0.5, false, true},
    {"half the resolution, without interpolation", 1, 0.5, false, false},
}};

// When the quality changes.
struct DrawingLimits {
  // Drawing slower than this goes a level down. Five images a second leave 200 ms for each, half of it for
  // tracking.
  double slow_s = 0.1;
  // Drawing faster than this may go a level up, which costs up to four times as much.
  double fast_s = 0.025;
  double down_after_s = 0.5;  // Frames are judged together over at least this time, by their median.
  // Two frames that are both slower than this are judged at once: a third one would leave a visitor with one
  // image for more than a second.
  double far_too_slow_s = 0.4;
  double up_after_s = 10;  // Doubled each time that going up was in vain.
};

// Chooses the quality by the time that drawing takes: tracking and input need the rest of the processor. A
// level is taken to cost half of the one above, so what takes several times too long goes several levels down
// at once. One thread.
class QualityController {
 public:
  explicit QualityController(const DrawingLimits& limits = {})
      : limits_(limits), up_after_s_(limits.up_after_s) {}

  // A frame took this long to draw; `now_s` is the time after it, which does not decrease. Returns whether
  // the quality has changed.
  bool Add(double now_s, double drawing_s);
  const DrawingQuality& quality() const { return kQualityLevels[level_]; }
  std::size_t level() const { return level_; }

 private:
  void Begin(double now_s);
  double Median();
  bool IsToBeJudged(double now_s) const;

  const DrawingLimits limits_;
  std::size_t level_ = 0;
  double begin_s_ = -1;               // Of the frames that are judged together; negative before the first.
  std::array<double, 32> times_s_{};  // Their drawing times, as far as there is room.
  std::size_t frames_ = 0;
  double fast_since_s_ = 0;  // Since when all frames were drawn fast.
  double up_after_s_;
  double went_up_s_ = -1e9;  // When the quality was raised last.
};

}  // namespace docent::ui

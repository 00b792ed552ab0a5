// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "app/simulator/exposure_jumps.h"

namespace docent::app {

// What happens to the light behind the lens: vignetting, an exposure that wanders slowly and may jump,
// clipping at 255, and noise, part of which may grow with the signal. An image's result depends on its
// number and the seed alone, not on what was made before. Immutable; any thread.
class Sensor {
 public:
  struct Options {
    cv::Size size;
    double vignetting = 0;      // part of the light lost in the corners, [0, 1)
    double exposure_drift = 0;  // standard size of the wandering of the logarithm of the gain
    double noise_sigma = 0;     // grey levels of 255
    std::uint64_t seed = 1;
    double gain = 1;  // of the exposure about which it wanders
    // Standard deviation of the noise of a signal of kReferenceSignal at gain 1. Its variance is proportional
    // to the signal and to the gain, as that of photons (the linear camera model of EMVA 1288), and adds to
    // noise_sigma's.
    double gain_noise_sigma = 0;
    ExposureJumps exposure_jumps = {};
  };
  static constexpr double kReferenceSignal = 128;  // grey levels

  explicit Sensor(const Options& options);

  // Turns light (CV_8UC3) into the sensor's image in place.
  void Apply(int frame, double time_s, cv::Mat* bgr) const;
  // Gain of the exposure at a time, about 1.
  double Gain(double time_s) const;

 private:
  // Standard deviation of the noise of each signal at this gain, in 1/4096 grey levels; only with gain noise.
  std::vector<std::int32_t> NoiseOfSignals_q12(double gain) const;

  Options options_;
  std::vector<std::uint16_t> shade_q12_;  // a pixel; empty without vignetting
  // Normal numbers, read from a random place on for each row: grey levels, or with gain noise of deviation 1.
  std::vector<std::int32_t> noise_q12_;
  double phases_rad_[2] = {0, 0};
};

}  // namespace docent::app

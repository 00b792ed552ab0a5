// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "app/simulator/exposure_jumps.h"

namespace docent::app {

// Simulates an image sensor: vignetting, an exposure that drifts slowly and may jump, clipping at 255, and
// noise, part of which may grow with the signal. The result depends only on the image's index and the seed.
// Immutable; any thread.
class Sensor {
 public:
  struct Options {
    cv::Size size;
    double vignetting = 0;      // Ratio of the light lost in the corners, in [0, 1).
    double exposure_drift = 0;  // Amplitude of the slow drift of the logarithm of the gain.
    double noise_sigma = 0;     // Grey levels of 255.
    std::uint64_t seed = 1;
    double gain = 1;  // Mean factor of the exposure.
    // Standard deviation of the photon noise at a signal of kReferenceSignal and gain 1. Its variance is
    // proportional to signal and gain (linear camera model of EMVA 1288) and is added to that of noise_sigma.
    double gain_noise_sigma = 0;
    ExposureJumps exposure_jumps = {};
  };
  static constexpr double kReferenceSignal = 128;  // Grey levels.

  explicit Sensor(const Options& options);

  // Converts the incident light (CV_8UC3) into the sensor's image in place.
  void Apply(int frame, double time_s, cv::Mat* bgr) const;
  // Factor of the exposure at a time, about 1.
  double Gain(double time_s) const;

 private:
  // Standard deviation of the noise for each signal at this gain, in 1/4096 grey levels; empty without gain
  // noise.
  std::vector<std::int32_t> NoiseOfSignals_q12(double gain) const;

  Options options_;
  std::vector<std::uint16_t> shade_q12_;  // For each pixel; empty without vignetting.
  // Normally distributed numbers, read from a random offset for each row: in grey levels, or with standard
  // deviation 1 when there is gain noise.
  std::vector<std::int32_t> noise_q12_;
  double phases_rad_[2] = {0, 0};
};

}  // namespace docent::app

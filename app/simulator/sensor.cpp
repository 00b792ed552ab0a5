// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/sensor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/base/random.h"

namespace docent::app {
namespace {

constexpr std::size_t kNoiseCount = std::size_t{1} << 17;
// Brighter signals are clipped in any case and use the noise of this one, in grey levels.
constexpr int kBrightestSignal = 1023;

}  // namespace

Sensor::Sensor(const Options& options) : options_(options) {
  Random random(options.seed);
  for (double& phase : phases_rad_) phase = random.Uniform(0, 2 * std::numbers::pi);
  const int width = options.size.width, height = options.size.height;
  if (options.vignetting > 0) {
    const double middle_x = 0.5 * (width - 1), middle_y = 0.5 * (height - 1);
    const double corner = middle_x * middle_x + middle_y * middle_y;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const double share =
            ((x - middle_x) * (x - middle_x) + (y - middle_y) * (y - middle_y)) / std::max(corner, 1.0);
        shade_q12_.push_back(
            static_cast<std::uint16_t>(std::lround(4096 * (1 - options.vignetting * share))));
      }
    }
  }
  if (options.noise_sigma > 0 || options.gain_noise_sigma > 0) {
    const double sigma = options.gain_noise_sigma > 0 ? 1 : options.noise_sigma;
    noise_q12_.resize(kNoiseCount);
    for (std::int32_t& noise : noise_q12_) {
      // The sum of twelve uniform numbers is nearly normal, and does not depend on the mathematics library.
      double sum = -6;
      for (int i = 0; i < 12; ++i) sum += random.Uniform();
      noise = static_cast<std::int32_t>(std::lround(sum * sigma * 4096));
    }
  }
}

double Sensor::Gain(double time_s) const {
  const double tau = 2 * std::numbers::pi;
  const double drift =
      std::sin(tau * 0.07 * time_s + phases_rad_[0]) + 0.5 * std::sin(tau * 0.23 * time_s + phases_rad_[1]);
  return options_.gain * std::exp(options_.exposure_drift * drift) * options_.exposure_jumps.Gain(time_s);
}

std::vector<std::int32_t> Sensor::NoiseOfSignals_q12(double gain) const {
  std::vector<std::int32_t> deviations;
  if (options_.gain_noise_sigma == 0) return deviations;
  const double constant = options_.noise_sigma * options_.noise_sigma;
  const double growth = options_.gain_noise_sigma * options_.gain_noise_sigma * gain / kReferenceSignal;
  for (int signal = 0; signal <= kBrightestSignal; ++signal)
    deviations.push_back(
        static_cast<std::int32_t>(std::lround(4096 * std::sqrt(constant + growth * signal))));
  return deviations;
}

void Sensor::Apply(int frame, double time_s, cv::Mat* bgr) const {
  if (options_.exposure_drift == 0 && options_.gain == 1 && options_.exposure_jumps.jumps().empty() &&
      shade_q12_.empty() && noise_q12_.empty()) {
    return;
  }
  // With a greater gain every signal but 0 is clipped too, and the products below would not fit into 32 bits.
  constexpr double kMaxGain = 1000;
  const double exposure = std::min(Gain(time_s), kMaxGain);
  const int gain_q12 = static_cast<int>(std::lround(4096 * exposure));
  const std::vector<std::int32_t> deviations_q12 = NoiseOfSignals_q12(exposure);
  Random random(options_.seed ^ (0xD1B54A32D192ED03ull * (static_cast<std::uint64_t>(frame) + 1)));
  const int channels = 3 * bgr->cols;
  const std::vector<std::int32_t> silence(noise_q12_.empty() ? static_cast<std::size_t>(channels) : 0, 0);
  std::vector<std::int32_t> gains(static_cast<std::size_t>(channels), gain_q12);
  for (int y = 0; y < bgr->rows; ++y) {
    if (!shade_q12_.empty()) {
      const std::uint16_t* shade = shade_q12_.data() + static_cast<std::size_t>(y) * bgr->cols;
      for (int x = 0; x < bgr->cols; ++x) {
        const auto gain = static_cast<std::int32_t>((std::int64_t{gain_q12} * shade[x]) >> 12);
        gains[3 * x] = gains[3 * x + 1] = gains[3 * x + 2] = gain;
      }
    }
    const std::int32_t* noise = silence.data();
    if (!noise_q12_.empty()) {
      noise = noise_q12_.data() + random.Below(static_cast<std::uint32_t>(kNoiseCount - channels));
    }
    uchar* row = bgr->ptr<uchar>(y);
    if (!deviations_q12.empty()) {
      for (int i = 0; i < channels; ++i) {
        const int signal_q12 = row[i] * gains[i];
        const std::int64_t deviation_q12 = deviations_q12[std::min(signal_q12 >> 12, kBrightestSignal)];
        const int noise_of_signal_q12 = static_cast<int>((noise[i] * deviation_q12) >> 12);
        row[i] = static_cast<uchar>(std::clamp((signal_q12 + noise_of_signal_q12 + 2048) >> 12, 0, 255));
      }
      continue;
    }
    for (int i = 0; i < channels; ++i) {
      row[i] = static_cast<uchar>(std::clamp((row[i] * gains[i] + noise[i] + 2048) >> 12, 0, 255));
    }
  }
}

}  // namespace docent::app

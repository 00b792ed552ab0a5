// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/tremor.h"

#include <cmath>
#include <numbers>

#include "engine/base/random.h"

namespace docent::app {

Tremor::Tremor(double rotation_deg, std::uint64_t seed) : is_still_(rotation_deg == 0) {
  Random random(seed);
  for (std::size_t axis = 0; axis < waves_.size(); ++axis) {
    double power = 0;
    for (int i = 0; i < kWaves; ++i) {
      Wave& wave = waves_[axis][static_cast<std::size_t>(i)];
      // One wave in each part of the band, so that the band has no gaps.
      wave.frequency_hz = kLowest_hz + (kHighest_hz - kLowest_hz) * (i + random.Uniform()) / kWaves;
      wave.phase_rad = random.Uniform(0, 2 * std::numbers::pi);
      wave.amplitude = 1 / (wave.frequency_hz * wave.frequency_hz);
      power += 0.5 * wave.amplitude * wave.amplitude;
    }
    const double rms = rotation_deg * std::numbers::pi / 180 * (axis < 3 ? kLever_m : 1);
    for (Wave& wave : waves_[axis]) wave.amplitude *= rms / std::sqrt(power);
  }
}

engine::Rigid3 Tremor::SteadyFromTrembling(double time_s) const {
  Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
  for (std::size_t axis = 0; axis < waves_.size(); ++axis) {
    for (const Wave& wave : waves_[axis]) {
      sum[static_cast<Eigen::Index>(axis)] +=
          wave.amplitude * std::sin(2 * std::numbers::pi * wave.frequency_hz * time_s + wave.phase_rad);
    }
  }
  return {engine::Rotation3::Exp(sum.tail<3>()), sum.head<3>()};
}

}  // namespace docent::app

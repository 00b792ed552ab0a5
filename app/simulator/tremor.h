// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "engine/geometry/rigid3.h"

namespace docent::app {

// The tremor of a hand that holds a camera, beside the way that it goes: rotation about and translation along
// each axis as a sum of waves from 4 Hz (measured on cameras in use, Japanese Journal of Ergonomics 31(6),
// 1995) to 12 Hz (the upper end of physiological tremor, 8 to 12 Hz). Its acceleration is spread evenly over
// that band, so that amplitudes fall with the square of the frequency. Immutable; any thread.
class Tremor {
 public:
  static constexpr double kLowest_hz = 4, kHighest_hz = 12;
  // From the wrist, about which a hand trembles, to the lens, metres: translation is rotation times this.
  static constexpr double kLever_m = 0.1;

  // rotation_deg: root mean square about each axis.
  Tremor(double rotation_deg, std::uint64_t seed);

  bool is_still() const { return is_still_; }
  engine::Rigid3 SteadyFromTrembling(double time_s) const;

 private:
  static constexpr int kWaves = 12;  // for each axis; their sum does not repeat within a sequence
  struct Wave {
    double frequency_hz, phase_rad, amplitude;
  };
  bool is_still_;
  std::array<std::array<Wave, kWaves>, 6> waves_;  // metres along x y z, radians about x y z
};

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>

#include "engine/geometry/rigid3.h"

namespace docent::app {

// Tremor of a hand that holds a camera, in addition to its trajectory: rotation about and translation along
// each axis as a sum of waves from 4 Hz (measured on cameras in use, Japanese Journal of Ergonomics 31(6),
// 1995) to 12 Hz (the upper end of physiological tremor, 8 to 12 Hz). The acceleration is uniform over that
// band, so amplitudes decrease with the square of the frequency. Immutable; any thread.
class Tremor {
 public:
  static constexpr double kLowest_hz = 4, kHighest_hz = 12;
  // Distance in metres from the wrist, the centre of the tremor, to the lens; the translation is the rotation
  // times this.
  static constexpr double kLever_m = 0.1;

  // rotation_deg: RMS rotation about each axis.
  Tremor(double rotation_deg, std::uint64_t seed);

  bool is_still() const { return is_still_; }
  engine::Rigid3 SteadyFromTrembling(double time_s) const;

 private:
  static constexpr int kWaves =
      12;  // For each axis; enough that their sum does not repeat within a sequence.
  struct Wave {
    double frequency_hz, phase_rad, amplitude;
  };
  bool is_still_;
  std::array<std::array<Wave, kWaves>, 6> waves_;  // Metres along x y z, radians about x y z.
};

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace docent::app {

// Simulates automatic exposure when a lamp or a window comes into view: at random times, three seconds apart
// on average, the exposure jumps up or down by 50 to 100 % of the given stops and recovers exponentially.
// Immutable; any thread.
class ExposureJumps {
 public:
  static constexpr double kMeanInterval_s = 3;
  // Three time constants are 1.5 s, which a webcam's automatic exposure takes to settle.
  static constexpr double kRecovery_s = 0.5;

  struct Jump {
    double time_s, stops;
  };

  ExposureJumps() = default;
  ExposureJumps(double largest_stops, double duration_s, std::uint64_t seed);

  // Factor of the exposure at a time; exactly 1 without jumps and before the first jump.
  double Gain(double time_s) const;
  const std::vector<Jump>& jumps() const { return jumps_; }

 private:
  std::vector<Jump> jumps_;  // Ordered by time.
};

}  // namespace docent::app

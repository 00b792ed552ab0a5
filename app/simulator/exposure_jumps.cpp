// SPDX-License-Identifier: Apache-2.0
#include "app/simulator/exposure_jumps.h"

#include <algorithm>
#include <cmath>

#include "engine/base/random.h"

namespace docent::app {

ExposureJumps::ExposureJumps(double largest_stops, double duration_s, std::uint64_t seed) {
  if (largest_stops == 0) return;
  Random random(seed);
  for (double time_s = 0;;) {
    time_s -=
        kMeanInterval_s * std::log(1 - random.Uniform());  // A Poisson process has exponential intervals.
    if (time_s > duration_s) return;
    const double stops = random.Uniform(0.5, 1) * largest_stops;
    jumps_.push_back({time_s, random.Uniform() < 0.5 ? -stops : stops});
  }
}

double ExposureJumps::Gain(double time_s) const {
  constexpr double kMaxAge_s = 20 * kRecovery_s;  // Less than 1e-6 stops remain of an older jump.
  auto jump = std::upper_bound(jumps_.begin(), jumps_.end(), time_s,
                               [](double time, const Jump& other) { return time < other.time_s; });
  double stops = 0;
  while (jump != jumps_.begin() && time_s - (--jump)->time_s < kMaxAge_s)
    stops += jump->stops * std::exp(-(time_s - jump->time_s) / kRecovery_s);
  return stops == 0 ? 1 : std::exp2(stops);
}

}  // namespace docent::app

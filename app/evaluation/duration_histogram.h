// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "engine/base/time.h"

namespace docent::app {

// Counts durations in bins whose widths are 2 % of their values, so that the quantiles of a tour that lasts
// for days take no more memory than those of a minute. One thread at a time.
class DurationHistogram {
 public:
  // Adds a duration. Negative ones count as 0.
  void Add(Timestamp duration);
  // The quantile by the nearest-rank method, in milliseconds, known to 1 % from 1 us to a day; the greatest
  // duration is exact. `part` is in (0, 1]. 0 without durations.
  double Quantile_ms(double part) const;
  std::uint64_t count() const { return count_; }

 private:
  static constexpr int kBins = 1273;  // The last one begins at a day.
  static std::size_t BinOf(Timestamp duration);

  std::array<std::uint32_t, kBins> counts_{};
  std::uint64_t count_ = 0;
  Timestamp least_{0}, greatest_{0};
};

}  // namespace docent::app

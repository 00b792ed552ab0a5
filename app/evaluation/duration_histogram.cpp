// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/duration_histogram.h"

#include <algorithm>
#include <cmath>

namespace docent::app {

namespace {

constexpr double kLeast_us = 1, kGrowth = 1.02;

double Microseconds(Timestamp duration) {
  return 1e6 * ToSeconds(duration);
}

}  // namespace

std::size_t DurationHistogram::BinOf(Timestamp duration) {
  const double relative = std::max(1.0, Microseconds(duration) / kLeast_us);
  return std::min(static_cast<std::size_t>(std::log(relative) / std::log(kGrowth)), std::size_t{kBins} - 1);
}

void DurationHistogram::Add(Timestamp duration) {
  duration = std::max(duration, Timestamp{0});
  least_ = count_ == 0 ? duration : std::min(least_, duration);
  greatest_ = std::max(greatest_, duration);
  ++count_;
  ++counts_[BinOf(duration)];
}

double DurationHistogram::Quantile_ms(double part) const {
  if (count_ == 0) return 0;
  const double least_ms = 1e3 * ToSeconds(least_), greatest_ms = 1e3 * ToSeconds(greatest_);
  const auto rank = static_cast<std::uint64_t>(std::ceil(part * static_cast<double>(count_)));
  if (rank >= count_) return greatest_ms;
  std::uint64_t below = 0;
  std::size_t bin = 0;
  while (bin + 1 < counts_.size() && (below += counts_[bin]) < rank) ++bin;
  const double middle_us = kLeast_us * std::pow(kGrowth, static_cast<double>(bin) + 0.5);
  return std::clamp(1e-3 * middle_us, least_ms, greatest_ms);
}

}  // namespace docent::app

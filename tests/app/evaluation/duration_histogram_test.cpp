// SPDX-License-Identifier: Apache-2.0
#include "app/evaluation/duration_histogram.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <vector>

#include "app/evaluation/evaluate_run.h"
#include "engine/base/random.h"

namespace docent::app {
namespace {

TEST(DurationHistogram, KnowsQuantilesToOnePercent) {
  Random random(3);
  DurationHistogram histogram;
  std::vector<double> all_ms;
  for (int i = 0; i < 20'000; ++i) {
    const double ms = std::exp(random.Uniform(std::log(0.002), std::log(60'000.0)));
    const Timestamp duration(static_cast<Timestamp::rep>(1e6 * ms));
    histogram.Add(duration);
    all_ms.push_back(1e3 * ToSeconds(duration));
  }
  EXPECT_EQ(histogram.count(), 20'000u);
  for (const double part : {0.0001, 0.01, 0.25, 0.5, 0.9, 0.95, 0.999}) {
    const double truth_ms = Quantile(all_ms, part);
    EXPECT_NEAR(histogram.Quantile_ms(part), truth_ms, 0.01 * truth_ms) << part;
  }
  EXPECT_EQ(histogram.Quantile_ms(1), Quantile(all_ms, 1)) << "the greatest duration is exact";
}

TEST(DurationHistogram, IsExactWhereAllDurationsAreEqual) {
  DurationHistogram histogram;
  for (int i = 0; i < 5; ++i) histogram.Add(std::chrono::milliseconds(7));
  EXPECT_EQ(histogram.Quantile_ms(0.5), 7);
}

TEST(DurationHistogram, AcceptsNoDurationAndAnyDuration) {
  DurationHistogram histogram;
  EXPECT_EQ(histogram.Quantile_ms(0.5), 0) << "without durations";
  histogram.Add(-std::chrono::seconds(1));
  EXPECT_EQ(histogram.Quantile_ms(1), 0) << "a clock that was set back";
  histogram.Add(std::chrono::hours(24 * 365));
  EXPECT_NEAR(histogram.Quantile_ms(0.5), 0, 0.0011) << "less than a microsecond is not resolved";
  EXPECT_EQ(histogram.Quantile_ms(1), 1e3 * 24 * 365 * 3600);
}

}  // namespace
}  // namespace docent::app

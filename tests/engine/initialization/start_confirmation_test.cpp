// SPDX-License-Identifier: Apache-2.0
#include "engine/initialization/start_confirmation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "engine/base/random.h"

namespace docent::engine {
namespace {

constexpr Timestamp kFirst = std::chrono::seconds(1);

std::vector<std::uint32_t> FirstIds(std::size_t count) {
  std::vector<std::uint32_t> ids(count);
  std::iota(ids.begin(), ids.end(), 0u);
  return ids;
}

// Depths of 100 points, in units of the baseline that corresponds to this parallax, each wrong by a random
// factor.
TwoViewResult Geometry(double parallax_deg, double relative_error, std::uint64_t seed) {
  Random depths(7), errors(seed);
  TwoViewResult result;
  result.median_parallax_deg = parallax_deg;
  for (int i = 0; i < 100; ++i) {
    const double depth = depths.Uniform(20, 60) / parallax_deg;
    result.points_in_a.push_back(Eigen::Vector3d::UnitZ() * depth *
                                 std::exp(errors.Uniform(-relative_error, relative_error)));
    result.inlier.push_back(true);
  }
  return result;
}

TEST(StartConfirmation, RequiresAThirdViewThatAgrees) {
  StartConfirmation confirmation({});
  EXPECT_FALSE(confirmation.Confirm(kFirst, FirstIds(100), Geometry(1.0, 0.1, 1)));
  EXPECT_FALSE(confirmation.Confirm(kFirst, FirstIds(100), Geometry(1.05, 0.1, 2)))
      << "the parallax has hardly grown";
  EXPECT_TRUE(confirmation.Confirm(kFirst, FirstIds(100), Geometry(1.2, 0.1, 3)));
}

TEST(StartConfirmation, NeedsNoGrowthWhereTheParallaxDoesNotGrow) {
  StartConfirmationOptions options;
  options.min_growth = 0;
  StartConfirmation confirmation(options);
  EXPECT_FALSE(confirmation.Awaits(kFirst));
  EXPECT_FALSE(confirmation.Confirm(kFirst, FirstIds(100), Geometry(1.2, 0.1, 1)));
  EXPECT_TRUE(confirmation.Awaits(kFirst));
  EXPECT_FALSE(confirmation.Awaits(2 * kFirst));
  EXPECT_TRUE(confirmation.Confirm(kFirst, FirstIds(100), Geometry(0.8, 0.1, 2)));
}

TEST(StartConfirmation, RejectsDepthsThatTheThirdViewContradicts) {
  StartConfirmation confirmation({});
  EXPECT_FALSE(confirmation.Confirm(kFirst, FirstIds(100), Geometry(1.0, 1.0, 1)));
  EXPECT_FALSE(confirmation.Confirm(kFirst, FirstIds(100), Geometry(1.5, 0.1, 2)));
  EXPECT_TRUE(confirmation.Confirm(kFirst, FirstIds(100), Geometry(2.0, 0.1, 3)))
      << "the third view agrees with the second estimate";
}

TEST(StartConfirmation, ComparesOnlyGeometriesOfTheSameFirstView) {
  StartConfirmation confirmation({});
  EXPECT_FALSE(confirmation.Confirm(kFirst, FirstIds(100), Geometry(1.0, 0.1, 1)));
  EXPECT_FALSE(confirmation.Confirm(2 * kFirst, FirstIds(100), Geometry(1.5, 0.1, 2)));
  confirmation.Reset();
  EXPECT_FALSE(confirmation.Confirm(2 * kFirst, FirstIds(100), Geometry(2.0, 0.1, 3)));
}

TEST(StartConfirmation, RequiresEnoughSharedPoints) {
  StartConfirmation confirmation({});
  EXPECT_FALSE(confirmation.Confirm(kFirst, FirstIds(100), Geometry(1.0, 0.1, 1)));
  TwoViewResult few = Geometry(1.5, 0.1, 2);
  std::fill(few.inlier.begin() + 20, few.inlier.end(), false);
  EXPECT_FALSE(confirmation.Confirm(kFirst, FirstIds(100), few));
}

}  // namespace
}  // namespace docent::engine

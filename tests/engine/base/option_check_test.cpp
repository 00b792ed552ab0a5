// SPDX-License-Identifier: Apache-2.0
#include "engine/base/option_check.h"

#include <gtest/gtest.h>

#include <limits>

namespace docent {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(OptionCheck, FindsNothingWrongWithinTheRanges) {
  EXPECT_FALSE(OptionCheck()
                   .Ratio(0, "a")
                   .Ratio(1, "b")
                   .Within(3, 3, 4, "c")
                   .AtLeast(2, 2, "d")
                   .Positive(1e-9, "e")
                   .NotNegative(Timestamp{}, "f")
                   .That(true, "g")
                   .Contained(std::nullopt)
                   .fault());
}

TEST(OptionCheck, SaysWhatTheFirstFaultIs) {
  EXPECT_EQ(OptionCheck().Ratio(0.5, "share").Ratio(1.5, "inlier ratio").Positive(0, "depth").fault(),
            "The inlier ratio must be from 0 to 1.");
  EXPECT_EQ(OptionCheck().AtLeast(1, 2, "number of frames").fault(),
            "The number of frames must be at least 2.");
  EXPECT_EQ(OptionCheck().NotNegative(Timestamp(-1), "window").fault(), "The window must be 0 or longer.");
  EXPECT_EQ(OptionCheck().Contained("The lens is bent.").That(false, "No.").fault(), "The lens is bent.");
}

TEST(OptionCheck, RefusesNaNAndInfinity) {
  EXPECT_TRUE(OptionCheck().Ratio(kNaN, "a").fault());
  EXPECT_TRUE(OptionCheck().AtLeast(kNaN, 0, "a").fault());
  EXPECT_TRUE(OptionCheck().AtLeast(kInfinity, 0, "a").fault());
  EXPECT_TRUE(OptionCheck().Positive(kNaN, "a").fault());
  EXPECT_TRUE(OptionCheck().Positive(kInfinity, "a").fault());
}

struct Options {
  double ratio = 0;
  std::optional<std::string> Validate() const { return OptionCheck().Ratio(ratio, "ratio").fault(); }
};

TEST(Checked, ReturnsValidOptionsAndThrowsForOthers) {
  const Options options;
  EXPECT_EQ(&Checked(options), &options);
  EXPECT_THROW(Checked(Options{2}), Error);
}

}  // namespace
}  // namespace docent

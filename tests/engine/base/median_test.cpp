// SPDX-License-Identifier: Apache-2.0
#include "engine/base/median.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "engine/base/random.h"

namespace docent {
namespace {

TEST(Median, IsTheMiddleOfAnOddNumberOfValues) {
  EXPECT_EQ(Median({7}), 7);
  EXPECT_EQ(Median({3, 1, 2}), 2);
  EXPECT_EQ(Median({-1, 100, 0, 5, -50}), 0);
}

TEST(Median, IsTheUpperOfTheTwoMiddleValuesOfAnEvenNumber) {
  EXPECT_EQ(Median({2, 1}), 2);
  EXPECT_EQ(Median({4, 1, 3, 2}), 3);
}

TEST(Median, IsTheGivenValueIfThereAreNone) {
  EXPECT_EQ(Median({}), 0);
  EXPECT_EQ(Median({}, 2.5), 2.5);
  EXPECT_EQ(Median({1}, 2.5), 1);
}

TEST(Median, CountsEqualValuesOneByOne) {
  EXPECT_EQ(Median({1, 1, 1, 9, 9}), 1);
  EXPECT_EQ(Median({1, 1, 9, 9, 9}), 9);
}

TEST(Median, EqualsThatOfSortedValuesInAnyOrder) {
  Random random(1);
  for (std::size_t count = 1; count <= 40; ++count) {
    std::vector<double> values;
    for (std::size_t i = 0; i < count; ++i) values.push_back(random.Below(10));
    const double median = Median(values);
    std::sort(values.begin(), values.end());
    EXPECT_EQ(median, values[count / 2]) << count;
  }
}

}  // namespace
}  // namespace docent

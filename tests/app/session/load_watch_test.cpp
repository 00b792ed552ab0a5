// SPDX-License-Identifier: Apache-2.0
#include "app/session/load_watch.h"

#include <gtest/gtest.h>

#include <chrono>
#include <vector>

namespace docent::app {
namespace {

// Seconds of images at 30 a second, of which all but every n-th are dropped, and what is said about them.
std::vector<LoadWatch::Change> Watch(LoadWatch* watch, double* seconds, double duration_s, int keep_every) {
  std::vector<LoadWatch::Change> changes;
  const double end = *seconds + duration_s;
  for (int i = 0; *seconds < end; ++i, *seconds += 1.0 / 30) {
    if (const auto change = watch->Add(FromSeconds(*seconds), i % keep_every != 0))
      changes.push_back(*change);
  }
  return changes;
}

TEST(LoadWatch, SaysOnceThatMostImagesAreDroppedAndOnceThatItIsOver) {
  LoadWatch watch;
  double seconds = 0;
  EXPECT_TRUE(Watch(&watch, &seconds, 20, 1).empty());
  const auto slow = Watch(&watch, &seconds, 20, 6);
  ASSERT_EQ(slow.size(), 1u);
  EXPECT_TRUE(slow[0].is_slow);
  EXPECT_GT(slow[0].dropped, 45);
  EXPECT_NEAR(slow[0].images, 90, 2);
  EXPECT_TRUE(watch.is_slow());
  const auto good = Watch(&watch, &seconds, 20, 1);
  ASSERT_EQ(good.size(), 1u);
  EXPECT_FALSE(good[0].is_slow);
  EXPECT_FALSE(watch.is_slow());
}

TEST(LoadWatch, SaysNothingWhileEverySecondImageIsTracked) {
  LoadWatch watch;
  double seconds = 0;
  EXPECT_TRUE(Watch(&watch, &seconds, 60, 2).empty());
}

}  // namespace
}  // namespace docent::app

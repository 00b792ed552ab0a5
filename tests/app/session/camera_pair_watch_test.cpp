// SPDX-License-Identifier: Apache-2.0
#include "app/session/camera_pair_watch.h"

#include <gtest/gtest.h>

namespace docent::app {
namespace {

// Both cameras at 30 images a second for a while. Returns when, in seconds from now, something was said of
// the second one; negative if nothing was.
double See(CameraPairWatch* watch, double* seconds, double duration_s, bool first, bool second) {
  double said_s = -1;
  const double begin = *seconds;
  for (; *seconds < begin + duration_s; *seconds += 1.0 / 30) {
    EXPECT_FALSE(watch->Update(0, *seconds, first));
    if (watch->Update(1, *seconds + 0.01, second)) said_s = *seconds - begin;
  }
  return said_s;
}

TEST(CameraPairWatch, SaysOnceThatACameraIsNotWhereTheOtherIs) {
  CameraPairWatch watch;
  double seconds = 5;
  EXPECT_NEAR(See(&watch, &seconds, 100, true, false), 30, 0.2);
  EXPECT_LT(See(&watch, &seconds, 100, true, false), 0);
}

TEST(CameraPairWatch, SaysNothingOfCamerasThatAreFoundNowAndThen) {
  CameraPairWatch watch;
  double seconds = 0;
  for (int i = 0; i < 20; ++i) {
    EXPECT_LT(See(&watch, &seconds, 25, true, false), 0);
    EXPECT_LT(See(&watch, &seconds, 0.5, true, true), 0);
  }
}

TEST(CameraPairWatch, SaysNothingWhileBothAreLost) {
  CameraPairWatch watch;
  double seconds = 0;
  EXPECT_LT(See(&watch, &seconds, 20, true, true), 0);
  EXPECT_LT(See(&watch, &seconds, 200, false, false), 0);
  EXPECT_LT(See(&watch, &seconds, 25, true, false), 0) << "the time with both lost does not count";
}

}  // namespace
}  // namespace docent::app

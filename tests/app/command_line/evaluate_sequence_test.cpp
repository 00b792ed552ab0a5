// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/evaluate_sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace docent::app {
namespace {

using testing::ElementsAre;

TEST(FirstFrames, KeepsWindowsWithinTheSequence) {
  EXPECT_THAT(FirstFrames(5, 100, 20), ElementsAre(0, 20, 40, 60, 80));
  EXPECT_THAT(FirstFrames(3, 100, 99), ElementsAre(0, 33, 66))
      << "the windows do not fit with distinct first frames";
  EXPECT_THAT(FirstFrames(2, 100, 99), ElementsAre(0, 1));
}

TEST(FirstFrames, SpreadsUnlimitedWindowsOverTheWholeSequence) {
  EXPECT_THAT(FirstFrames(4, 100, 0), ElementsAre(0, 25, 50, 75));
  EXPECT_THAT(FirstFrames(1, 100, 20), ElementsAre(0));
  EXPECT_THAT(FirstFrames(4, 100, 200), ElementsAre(0, 25, 50, 75))
      << "the window is longer than the sequence";
}

}  // namespace
}  // namespace docent::app

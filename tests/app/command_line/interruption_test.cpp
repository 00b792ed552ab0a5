// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/interruption.h"

#include <gtest/gtest.h>

#include <csignal>

namespace docent::app {
namespace {

TEST(Interruption, IgnoresASignalThatComesAgainAtOnce) {
  const Interruption interruption(std::chrono::hours(1));
  EXPECT_FALSE(Interruption::requested());
  for (const int signal : {SIGTERM, SIGINT}) {
    for (int i = 0; i < 3; ++i) std::raise(signal);
  }
  EXPECT_TRUE(Interruption::requested());
}

TEST(Interruption, EndsTheProgramByALaterSignalOfTheSameKind) {
  EXPECT_EXIT(
      {
        const Interruption interruption(std::chrono::milliseconds(0));
        std::raise(SIGINT);
        std::raise(SIGTERM);
        if (Interruption::requested()) std::raise(SIGTERM);
      },
      testing::KilledBySignal(SIGTERM), "");
}

}  // namespace
}  // namespace docent::app

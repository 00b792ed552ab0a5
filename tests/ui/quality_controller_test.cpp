// SPDX-License-Identifier: Apache-2.0
#include "ui/quality_controller.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <utility>

namespace docent::ui {
namespace {

// A machine whose frames take this long on each level, at 30 images a second or as fast as it can.
struct Machine {
  std::array<double, kQualityLevels.size()> cost_s;
  QualityController controller = QualityController();
  double now_s = 0;
  int changes = 0;

  void Run(double duration_s) {
    for (const double end = now_s + duration_s; now_s < end;) {
      const double drawing_s = cost_s[controller.level()];
      now_s += std::max(drawing_s, 1.0 / 30);
      if (controller.Add(now_s, drawing_s)) ++changes;
    }
  }
};

TEST(QualityController, KeepsTheBestQualityOnAFastMachine) {
  Machine machine{{0.02, 0.01, 0.008, 0.005, 0.002, 0.001}};
  machine.Run(60);
  EXPECT_EQ(machine.controller.level(), 0u);
}

TEST(QualityController, GoesDownWithinSecondsToWhatTheMachineCanDraw) {
  Machine machine{{0.9, 0.4, 0.3, 0.15, 0.12, 0.06}};
  machine.Run(6);
  EXPECT_EQ(machine.controller.level(), 5u);
  Machine other{{0.15, 0.08, 0.06, 0.04, 0.02, 0.01}};
  other.Run(3);
  EXPECT_EQ(other.controller.level(), 1u);
}

TEST(QualityController, GoesDownAtOnceWhereTheFirstFramesAreFarTooSlow) {
  // With a tenth of a processor; see kQualityLevels.
  Machine machine{{2.2, 0.9, 0.7, 0.4, 0.19, 0.15}};
  machine.Run(4.3);
  EXPECT_EQ(machine.controller.level(), 5u);
  EXPECT_EQ(machine.changes, 1);
}

TEST(QualityController, IsNotMovedByASingleSlowFrame) {
  Machine machine{{0.02, 0.01, 0.008, 0.005, 0.002, 0.001}};
  for (int i = 0; i < 20; ++i) {
    machine.Run(2);
    machine.now_s += 0.4;
    machine.controller.Add(machine.now_s, 0.4);
  }
  EXPECT_EQ(machine.controller.level(), 0u);
}

TEST(QualityController, ComesBackWhenTheLoadIsGone) {
  Machine machine{{0.9, 0.4, 0.3, 0.15, 0.12, 0.06}};
  machine.Run(6);
  ASSERT_EQ(machine.controller.level(), 5u);
  machine.cost_s = {0.02, 0.01, 0.008, 0.005, 0.002, 0.001};
  machine.Run(120);
  EXPECT_EQ(machine.controller.level(), 0u);
}

TEST(QualityController, TriesAHigherQualityInVainEverMoreSeldom) {
  // The second level is drawn fast enough to try the first one, which is too slow.
  Machine machine{{0.15, 0.02, 0.01, 0.008, 0.005, 0.004}};
  machine.Run(60);
  const int first_minute = std::exchange(machine.changes, 0);
  machine.Run(540);
  EXPECT_GE(first_minute, 3);
  EXPECT_LE(machine.changes, 14) << "in nine minutes";
}

}  // namespace
}  // namespace docent::ui

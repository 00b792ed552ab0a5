// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/relocalization_confirmation.h"

#include <gtest/gtest.h>

namespace docent::engine {
namespace {

// A pose that explains this ratio of the points in view.
MapTrackResult Explaining(double ratio) {
  MapTrackResult result;
  result.attempted = 1000;
  result.inliers = static_cast<int>(1000 * ratio);
  return result;
}

RelocalizationConfirmation::Loss Far() {
  RelocalizationConfirmation::Loss loss;
  loss.found.translation.x() = 10;
  return loss;
}

TEST(RelocalizationConfirmation, PermitsExtensionWithoutARelocalization) {
  RelocalizationConfirmation confirmation{TrackerOptions()};
  EXPECT_TRUE(confirmation.Add(Explaining(0.1), false));
  EXPECT_FALSE(confirmation.is_pending());
}

TEST(RelocalizationConfirmation, WaitsForSeveralFramesThatExplainTheImage) {
  const TrackerOptions options;
  RelocalizationConfirmation confirmation(options);
  confirmation.Begin(Explaining(0.6), Far());
  for (int i = 0; i < options.confirming_frames; ++i) {
    EXPECT_TRUE(confirmation.is_pending());
    EXPECT_FALSE(confirmation.Add(Explaining(0.6), true)) << i;
  }
  EXPECT_FALSE(confirmation.is_pending());
  EXPECT_TRUE(confirmation.Add(Explaining(0.6), true));
}

TEST(RelocalizationConfirmation, DoesNotCountFramesThatExplainLittleAndStartsAgainAfterAPoorOne) {
  const TrackerOptions options;
  RelocalizationConfirmation confirmation(options);
  confirmation.Begin(Explaining(0.6), Far());
  for (int i = 0; i < 20; ++i) confirmation.Add(Explaining(0.4), true);
  EXPECT_TRUE(confirmation.is_pending());
  for (int i = 0; i + 1 < options.confirming_frames; ++i) confirmation.Add(Explaining(0.6), true);
  confirmation.Add(Explaining(0.4), false);
  confirmation.Add(Explaining(0.6), true);
  EXPECT_TRUE(confirmation.is_pending());
}

TEST(RelocalizationConfirmation, AsksNearTheLostPoseForHalfOfTheRatioFromBeforeTheLossOnly) {
  const TrackerOptions options;
  for (const bool near : {true, false}) {
    for (const bool enough : {true, false}) {
      const double ratio = enough ? 0.22 : 0.18;
      RelocalizationConfirmation confirmation(options);
      for (int i = 0; i < 100; ++i) confirmation.Add(Explaining(0.4), true);
      confirmation.Begin(Explaining(ratio), near ? RelocalizationConfirmation::Loss() : Far());
      for (int i = 0; i < options.confirming_frames; ++i) confirmation.Add(Explaining(ratio), true);
      EXPECT_EQ(confirmation.is_pending(), !near || !enough) << ratio;
    }
  }
}

TEST(RelocalizationConfirmation, CountsTheFramesOfAHypothesisNearTheLostPose) {
  RelocalizationConfirmation confirmation{TrackerOptions()};
  for (int i = 0; i < 100; ++i) confirmation.Add(Explaining(0.3), true);
  confirmation.Begin(Explaining(0.3), {});
  confirmation.CountHypothesis();
  confirmation.Add(Explaining(0.3), true);
  EXPECT_FALSE(confirmation.is_pending());
}

}  // namespace
}  // namespace docent::engine

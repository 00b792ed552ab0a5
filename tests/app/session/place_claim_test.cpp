// SPDX-License-Identifier: Apache-2.0
#include "app/session/place_claim.h"

#include <gtest/gtest.h>

namespace docent::app {
namespace {

using State = engine::TrackingState;

TEST(PlaceClaim, EndsSoonAfterOnlyTheRotationIsKnownAndBeginsWithAPosition) {
  PlaceClaim claim;
  EXPECT_TRUE(claim.Update(0, State::kSixDof, 1));
  EXPECT_TRUE(claim.Update(1.9, State::kPanorama, 1)) << "one who turns on the spot";
  EXPECT_FALSE(claim.Update(2.1, State::kPanorama, 1)) << "one who has walked on";
  EXPECT_FALSE(claim.Update(60, State::kPanorama, 1));
  EXPECT_TRUE(claim.Update(61, State::kHybrid, 1));
  EXPECT_TRUE(claim.Update(62, State::kPanorama, 1));
}

TEST(PlaceClaim, HoldsInAMapWithoutDepth) {
  PlaceClaim claim;
  EXPECT_TRUE(claim.Update(0, State::kSixDof, 1));
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(claim.Update(10 + i, State::kPanorama, 2));
}

TEST(PlaceClaim, NeedsAPose) {
  PlaceClaim claim;
  EXPECT_FALSE(claim.Update(0, State::kLost, 1));
  EXPECT_TRUE(claim.Update(1, State::kSixDof, 1));
  EXPECT_FALSE(claim.Update(1.1, State::kDropped, 1));
}

}  // namespace
}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#include "engine/system/map_assignment.h"

#include <gtest/gtest.h>

namespace docent::engine {
namespace {

using Order = MapAssignment::Order;

constexpr bool kFinite = true, kNoDepth = false;

TEST(MapAssignment, IsNoMapAtFirst) {
  MapAssignment assignment;
  EXPECT_EQ(assignment.map(), 0u);
  EXPECT_FALSE(assignment.has_order());
  EXPECT_EQ(assignment.TakeOrder(kNoDepth), Order::kNone);
  EXPECT_FALSE(assignment.is_starting());
}

TEST(MapAssignment, GivesAnOrderOnce) {
  MapAssignment assignment;
  assignment.Start(3, false);
  EXPECT_TRUE(assignment.has_order());
  EXPECT_EQ(assignment.TakeOrder(kNoDepth), Order::kStart);
  EXPECT_EQ(assignment.TakeOrder(kNoDepth), Order::kNone);
  EXPECT_EQ(assignment.map(), 3u);
}

TEST(MapAssignment, IsStartingUntilTheMapHasFinitePoints) {
  MapAssignment assignment;
  assignment.Start(3, false);
  EXPECT_FALSE(assignment.is_starting()) << "not before the camera's next frame";
  assignment.TakeOrder(kNoDepth);
  EXPECT_TRUE(assignment.is_starting());
  assignment.TakeOrder(kNoDepth);
  EXPECT_TRUE(assignment.is_starting());
  assignment.TakeOrder(kFinite);
  EXPECT_FALSE(assignment.is_starting());
}

TEST(MapAssignment, IsStartingWhileItGivesDepthToAMapThatWasEntered) {
  MapAssignment assignment;
  assignment.Enter(3);
  assignment.TakeOrder(kNoDepth);
  assignment.GiveDepth();
  EXPECT_EQ(assignment.TakeOrder(kNoDepth), Order::kGiveDepth);
  EXPECT_TRUE(assignment.is_starting());
  assignment.Follow(4);
  EXPECT_FALSE(assignment.is_starting()) << "it is in another map";
}

TEST(MapAssignment, StopsStartingWhenTheCameraLeavesOrEnters) {
  for (const bool leaves : {true, false}) {
    MapAssignment assignment;
    assignment.Start(3, false);
    assignment.TakeOrder(kNoDepth);
    if (leaves) {
      assignment.Leave();
    } else {
      assignment.Enter(4);
    }
    EXPECT_EQ(assignment.TakeOrder(kNoDepth), leaves ? Order::kLeave : Order::kEnter);
    EXPECT_FALSE(assignment.is_starting());
    EXPECT_EQ(assignment.map(), leaves ? 0u : 4u);
  }
}

TEST(MapAssignment, StartsAgainAfterAFailureOnlyWhileItIsStarting) {
  MapAssignment assignment;
  assignment.Enter(3);
  assignment.TakeOrder(kNoDepth);
  assignment.FailStart(false, false);
  EXPECT_FALSE(assignment.has_order());
  assignment.Start(3, false);
  assignment.TakeOrder(kNoDepth);
  assignment.FailStart(true, false);
  EXPECT_EQ(assignment.TakeOrder(kNoDepth), Order::kStartAgain) << "the panorama map stays";
  assignment.FailStart(false, true);
  EXPECT_EQ(assignment.TakeOrder(kNoDepth), Order::kStartAfterLoss);
}

TEST(MapAssignment, SearchesAgainUnlessSomethingElseWasOrdered) {
  MapAssignment assignment;
  assignment.Enter(3);
  assignment.TakeOrder(kFinite);
  assignment.SearchAgain();
  EXPECT_EQ(assignment.TakeOrder(kFinite), Order::kEnter);
  assignment.Leave();
  assignment.SearchAgain();
  EXPECT_EQ(assignment.TakeOrder(kFinite), Order::kLeave);
}

TEST(MapAssignment, RemembersTheFirstLostFrame) {
  MapAssignment assignment;
  assignment.Enter(3);
  EXPECT_FALSE(assignment.IsLostFor(Timestamp(0), FromSeconds(9)));
  assignment.SetLost(FromSeconds(1));
  assignment.SetLost(FromSeconds(2));
  EXPECT_EQ(assignment.lost_since(), FromSeconds(1));
  EXPECT_TRUE(assignment.IsLostFor(FromSeconds(0.5), FromSeconds(2)));
  EXPECT_FALSE(assignment.IsLostFor(FromSeconds(1), FromSeconds(2)));
  assignment.SetTracked();
  EXPECT_FALSE(assignment.lost_since());
  assignment.SetLost(FromSeconds(3));
  assignment.Enter(4);
  EXPECT_FALSE(assignment.lost_since()) << "in another map";
}

}  // namespace
}  // namespace docent::engine

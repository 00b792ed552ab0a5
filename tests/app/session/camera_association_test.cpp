// SPDX-License-Identifier: Apache-2.0
#include "app/session/camera_association.h"

#include <gtest/gtest.h>

namespace docent::app {
namespace {

constexpr std::size_t kHand = 0, kShoulder = 1;
constexpr std::uint64_t kEverywhere = 0;

// The story of ptamm Fig. 7, step by step.
TEST(Association, KeepsTwoCamerasInOneMapAndMovesThemTogether) {
  CameraAssociation cameras(2);
  EXPECT_EQ(cameras.SearchedMap(), kEverywhere);

  // (a) Both are tracked in map 1.
  EXPECT_TRUE(cameras.Tracked(kHand, 1));
  EXPECT_EQ(cameras.SearchedMap(), 1u);
  EXPECT_TRUE(cameras.Tracked(kShoulder, 1));

  // (b) The shoulder camera is lost and looks at map 2, but may be found in map 1 alone: it stays lost.
  cameras.Lost(kShoulder);
  EXPECT_EQ(cameras.SearchedMap(), 1u);
  EXPECT_FALSE(cameras.Tracked(kShoulder, 2));
  EXPECT_FALSE(cameras.IsTracked(kShoulder));
  EXPECT_TRUE(cameras.Tracked(kHand, 1));
  EXPECT_EQ(cameras.map(), 1u);

  // (c) Now both are lost, and both search everything.
  cameras.Lost(kHand);
  EXPECT_FALSE(cameras.AnyTracked());
  EXPECT_EQ(cameras.SearchedMap(), kEverywhere);

  // (d) The shoulder camera is the first to be found, in map 2: the hand-held one gives its search up.
  EXPECT_TRUE(cameras.Tracked(kShoulder, 2));
  EXPECT_EQ(cameras.map(), 2u);
  EXPECT_EQ(cameras.SearchedMap(), 2u);

  // (e) It is found in the recovered map, and they go on together.
  EXPECT_TRUE(cameras.Tracked(kHand, 2));
  EXPECT_TRUE(cameras.IsTracked(kHand) && cameras.IsTracked(kShoulder));
}

TEST(Association, LetsACameraThatIsTrackedAloneLeaveForAMapThatFitsBetter) {
  CameraAssociation cameras(2);
  EXPECT_TRUE(cameras.Tracked(kHand, 1));
  EXPECT_EQ(cameras.SearchedMap(kHand), kEverywhere);
  EXPECT_EQ(cameras.SearchedMap(kShoulder), 1u);
  EXPECT_TRUE(cameras.Tracked(kHand, 2));
  EXPECT_EQ(cameras.map(), 2u);
  EXPECT_TRUE(cameras.Tracked(kShoulder, 2));
  EXPECT_EQ(cameras.SearchedMap(kHand), 2u);
  EXPECT_FALSE(cameras.Tracked(kHand, 1)) << "the other one holds it";
}

TEST(Association, BelievesTheFirstOfTwoThatAreFoundAtTheSameMoment) {
  CameraAssociation cameras(2);
  EXPECT_TRUE(cameras.Tracked(kShoulder, 3));
  EXPECT_FALSE(cameras.Tracked(kHand, 5));
  EXPECT_EQ(cameras.SearchedMap(), 3u);
  EXPECT_TRUE(cameras.Tracked(kHand, 3));
}

TEST(Association, HoldsAllCamerasAtAMapThatBegins) {
  CameraAssociation cameras(2);
  EXPECT_TRUE(cameras.Tracked(kHand, 1));
  EXPECT_TRUE(cameras.Tracked(kShoulder, 1));
  cameras.Begin(2);
  EXPECT_FALSE(cameras.AnyTracked());
  EXPECT_EQ(cameras.SearchedMap(), 2u);
  EXPECT_FALSE(cameras.Tracked(kShoulder, 1));  // it still sees the old map
  EXPECT_TRUE(cameras.Tracked(kHand, 2));
  cameras.Lost(kHand);  // once somebody was in it, the usual rules hold
  EXPECT_EQ(cameras.SearchedMap(), kEverywhere);
}

TEST(Association, LetsACameraThatIsAloneGoWhereItLikes) {
  CameraAssociation camera(1);
  EXPECT_TRUE(camera.Tracked(0, 1));
  EXPECT_TRUE(camera.Tracked(0, 2));
  EXPECT_EQ(camera.map(), 2u);
}

TEST(Association, IsForgottenWhenTheMapIsLeft) {
  CameraAssociation cameras(2);
  EXPECT_TRUE(cameras.Tracked(kHand, 1));
  cameras.Release();
  EXPECT_EQ(cameras.SearchedMap(), kEverywhere);
  EXPECT_EQ(cameras.map(), 0u);
}

}  // namespace
}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#include "engine/system/camera_association.h"

#include <gtest/gtest.h>

namespace docent::app {
namespace {

constexpr std::size_t kHand = 0, kShoulder = 1;
constexpr std::uint64_t kEverywhere = 0;

// The example of ptamm Fig. 7, step by step.
TEST(Association, KeepsTwoCamerasInOneMapAndMovesThemTogether) {
  engine::CameraAssociation cameras(2);
  EXPECT_EQ(cameras.SearchedMap(), kEverywhere);

  // (a) Both are tracked in map 1.
  EXPECT_TRUE(cameras.SetTracked(kHand, 1));
  EXPECT_EQ(cameras.SearchedMap(), 1u);
  EXPECT_TRUE(cameras.SetTracked(kShoulder, 1));

  // (b) The shoulder camera is lost and sees map 2, but may relocalize in map 1 only: it stays lost.
  cameras.SetLost(kShoulder);
  EXPECT_EQ(cameras.SearchedMap(), 1u);
  EXPECT_FALSE(cameras.SetTracked(kShoulder, 2));
  EXPECT_FALSE(cameras.IsTracked(kShoulder));
  EXPECT_TRUE(cameras.SetTracked(kHand, 1));
  EXPECT_EQ(cameras.map(), 1u);

  // (c) Now both are lost, and both search all maps.
  cameras.SetLost(kHand);
  EXPECT_FALSE(cameras.AnyTracked());
  EXPECT_EQ(cameras.SearchedMap(), kEverywhere);

  // (d) The shoulder camera relocalizes first, in map 2: the hand-held one abandons its search.
  EXPECT_TRUE(cameras.SetTracked(kShoulder, 2));
  EXPECT_EQ(cameras.map(), 2u);
  EXPECT_EQ(cameras.SearchedMap(), 2u);

  // (e) The hand-held one relocalizes in map 2 too, and both continue together.
  EXPECT_TRUE(cameras.SetTracked(kHand, 2));
  EXPECT_TRUE(cameras.IsTracked(kHand) && cameras.IsTracked(kShoulder));
}

TEST(Association, LetsTheOnlyTrackedCameraEnterABetterMap) {
  engine::CameraAssociation cameras(2);
  EXPECT_TRUE(cameras.SetTracked(kHand, 1));
  EXPECT_EQ(cameras.SearchedMap(kHand), kEverywhere);
  EXPECT_EQ(cameras.SearchedMap(kShoulder), 1u);
  EXPECT_TRUE(cameras.SetTracked(kHand, 2));
  EXPECT_EQ(cameras.map(), 2u);
  EXPECT_TRUE(cameras.SetTracked(kShoulder, 2));
  EXPECT_EQ(cameras.SearchedMap(kHand), 2u);
  EXPECT_FALSE(cameras.SetTracked(kHand, 1)) << "the other camera is tracked in map 2";
}

TEST(Association, AcceptsTheFirstOfTwoCamerasThatRelocalizeAtTheSameTime) {
  engine::CameraAssociation cameras(2);
  EXPECT_TRUE(cameras.SetTracked(kShoulder, 3));
  EXPECT_FALSE(cameras.SetTracked(kHand, 5));
  EXPECT_EQ(cameras.SearchedMap(), 3u);
  EXPECT_TRUE(cameras.SetTracked(kHand, 3));
}

TEST(Association, KeepsAllCamerasInANewMap) {
  engine::CameraAssociation cameras(2);
  EXPECT_TRUE(cameras.SetTracked(kHand, 1));
  EXPECT_TRUE(cameras.SetTracked(kShoulder, 1));
  cameras.Begin(2);
  EXPECT_FALSE(cameras.AnyTracked());
  EXPECT_EQ(cameras.SearchedMap(), 2u);
  EXPECT_FALSE(cameras.SetTracked(kShoulder, 1));  // it still sees the old map
  EXPECT_TRUE(cameras.SetTracked(kHand, 2));
  cameras.SetLost(kHand);  // once a camera was tracked in the new map, the usual rules apply
  EXPECT_EQ(cameras.SearchedMap(), kEverywhere);
}

TEST(Association, LetsASingleCameraEnterAnyMap) {
  engine::CameraAssociation camera(1);
  EXPECT_TRUE(camera.SetTracked(0, 1));
  EXPECT_TRUE(camera.SetTracked(0, 2));
  EXPECT_EQ(camera.map(), 2u);
}

TEST(Association, IsResetWhenTheMapIsLeft) {
  engine::CameraAssociation cameras(2);
  EXPECT_TRUE(cameras.SetTracked(kHand, 1));
  cameras.Release();
  EXPECT_EQ(cameras.SearchedMap(), kEverywhere);
  EXPECT_EQ(cameras.map(), 0u);
}

}  // namespace
}  // namespace docent::app

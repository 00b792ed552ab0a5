// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/wide_baseline_views.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "tests/engine/tracking/tracked_image.h"

namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;
using testing_world::ImageAt;
using testing_world::World;

// A panorama map knows the rotation of a camera only.
std::vector<WideBaselineViews::Pair> Show(const Rigid3& camera_from_world, int frame,
                                          WideBaselineViews* views) {
  return views->Pairs(ImageAt(camera_from_world, frame),
                      {camera_from_world.rotation, Eigen::Vector3d::Zero()}, Eigen::Vector3d(0, 0.01, 0));
}

TEST(WideBaselineViews, MatchesAnImageThatWasTakenFromElsewhereLongAgo) {
  const Rigid3 before = CameraAt({0, 0, 0}), after = CameraAt({0.25, 0.05, 0.1}, {3, -4, 8});
  WideBaselineViews views;
  EXPECT_TRUE(Show(before, 0, &views).empty());
  EXPECT_TRUE(Show(CameraAt({0.1, 0, 0}, {0, 40, 0}), 20, &views).empty()) << "the camera looks elsewhere";
  const auto pairs = Show(after, 60, &views);
  ASSERT_EQ(pairs.size(), 1u);
  const WideBaselineViews::Pair& pair = pairs.front();
  EXPECT_EQ(pair.earlier.image.time, ImageAt(before, 0).time);
  EXPECT_EQ(pair.earlier.rotation_rate.y(), 0.01);
  ASSERT_EQ(pair.matches.size(), pair.ids.size());
  EXPECT_TRUE(std::is_sorted(pair.ids.begin(), pair.ids.end()));
  std::size_t right = 0;
  for (const InitialPair::Match& match : pair.matches) {
    const auto hit = World().AtPixel(*Camera(), before, match.pixel_a.cast<double>());
    if (!hit) continue;
    const auto seen = Camera()->Project(after * hit->point);
    right += seen && (*seen - match.pixel_b.cast<double>()).norm() < 1;
  }
  EXPECT_GE(right, 60u);
  EXPECT_GE(static_cast<double>(right), 0.85 * static_cast<double>(pair.matches.size()));
}

TEST(WideBaselineViews, LeavesYoungAndFarTurnedImagesOut) {
  WideBaselineViews views;
  Show(CameraAt({0, 0, 0}), 0, &views);
  EXPECT_TRUE(Show(CameraAt({0.2, 0, 0}), 15, &views).empty()) << "half a second old";
  EXPECT_TRUE(Show(CameraAt({0.2, 0, 0}, {0, 0, 20}), 60, &views).empty())
      << "20 degrees about the optical axis";
  EXPECT_EQ(Show(CameraAt({0.2, 0, 0}, {0, 0, 10}), 90, &views).size(), 3u);
}

TEST(WideBaselineViews, TriesThoseThatHaveWaitedLongestUnlessToldOtherwise) {
  WideBaselineViews views;
  for (int i = 0; i < 5; ++i) Show(CameraAt({0.05 * i, 0, 0}), i, &views);
  const auto times = [](const std::vector<WideBaselineViews::Pair>& pairs) {
    std::vector<Timestamp> all;
    for (const auto& pair : pairs) all.push_back(pair.earlier.image.time);
    return all;
  };
  const auto time = [](int i) { return ImageAt(CameraAt(Eigen::Vector3d::Zero()), i).time; };
  EXPECT_EQ(times(Show(CameraAt({0.3, 0, 0}), 100, &views)), (std::vector{time(0), time(1), time(2)}));
  const auto second = Show(CameraAt({0.3, 0, 0}), 104, &views);
  EXPECT_EQ(times(second), (std::vector{time(3), time(4), time(0)}));
  views.TryAgain(second[1].earlier);
  for (int call = 0; call < 8; ++call) {
    const auto again = times(Show(CameraAt({0.3, 0, 0}, {0, 0.1 * call, 0}), 108 + 4 * call, &views));
    ASSERT_FALSE(again.empty());
    EXPECT_EQ(again.front(), time(4));
  }
  EXPECT_NE(times(Show(CameraAt({0.3, 0, 0}), 140, &views)).front(), time(4)) << "it was tried last";
}

TEST(WideBaselineViews, KeepsTheFirstImageWhenOthersAreForgotten) {
  WideBaselineViews views;
  Show(CameraAt({0, 0, 0}), 0, &views);
  for (int call = 1; call < 60; ++call) Show(CameraAt({0, 0, 0}, {0, 90, 0}), 4 * call, &views);
  const auto pairs = Show(CameraAt({0.25, 0, 0}), 240, &views);
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs.front().earlier.image.time, ImageAt(CameraAt({0, 0, 0}), 0).time);
}

TEST(WideBaselineViews, RemembersImagesOfTheWholeTimeButNoMoreThanFortyEight) {
  WideBaselineViews views;
  std::set<Timestamp> used;
  constexpr int kCalls = 400;
  for (int call = 0; call < kCalls; ++call) {
    // Only the last calls look ahead.
    const double yaw_deg = call + 60 < kCalls && call % 8 != 0 ? 90 : 0;
    for (const auto& pair : Show(CameraAt({0.0005 * call, 0, 0}, {0, yaw_deg, 0}), 4 * call, &views))
      if (call + 60 >= kCalls) used.insert(pair.earlier.image.time);
  }
  EXPECT_LE(used.size(), 48u + 60u);
  EXPECT_LT(*used.begin(), ImageAt(CameraAt(Eigen::Vector3d::Zero()), kCalls).time)
      << "some are from the first quarter";
  views.Reset();
  EXPECT_TRUE(Show(CameraAt({0.3, 0, 0}), 4 * kCalls, &views).empty());
}

}  // namespace
}  // namespace docent::engine

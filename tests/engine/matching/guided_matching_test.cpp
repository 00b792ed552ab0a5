// SPDX-License-Identifier: Apache-2.0
#include "engine/matching/guided_matching.h"

#include <gtest/gtest.h>

#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "engine/vision/features.h"

namespace docent::engine {
namespace {

constexpr int kShift = 6;  // pixels to the left by which the second image shows the wall
constexpr double kWallDepth = 2, kWallFocal = 200;

// A wall parallel to the image planes of two cameras side by side. The points are corners of the first image,
// and the second keyframe observes none of them.
MapSnapshot MakeWall() {
  cv::Mat noise(240, 320 + kShift, CV_8UC1), wall;
  cv::RNG random(5);
  random.fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, wall, {}, 1.5);
  cv::normalize(wall, wall, 0, 255, cv::NORM_MINMAX);
  MapSnapshot map;
  const auto camera = std::make_shared<const CameraModel>(
      LensModel::kRadialTangential, CameraModel::Intrinsics{320, 240, kWallFocal, kWallFocal, 160, 120},
      std::array<double, 5>{});
  for (int i = 0; i < 2; ++i) {
    KeyFrame keyframe;
    keyframe.id = static_cast<KeyFrameId>(i);
    keyframe.fixed = true;
    keyframe.camera = camera;
    keyframe.mean_depth = kWallDepth;
    keyframe.camera_from_map.translation.x() = -i * kShift * kWallDepth / kWallFocal;
    keyframe.features = MakeFeatures(wall(cv::Rect(i * kShift, 0, 320, 240)).clone());
    map.keyframes.push_back(keyframe);
  }
  for (const Corner& corner : map.keyframes[0].features->corners[0]) {
    if (corner.x < 20 || corner.y < 20 || corner.x > 300 || corner.y > 220) continue;
    MapPoint point;
    point.id = map.next_point++;
    point.point_in_map << (corner.x - 160) * kWallDepth / kWallFocal,
        (corner.y - 120) * kWallDepth / kWallFocal, kWallDepth, 1;
    point.source_keyframe = 0;
    point.source_pixel = {static_cast<float>(corner.x), static_cast<float>(corner.y)};
    map.points.push_back(point);
    map.observations.push_back({0, point.id, point.source_pixel, 0});
  }
  map.next_keyframe = 2;
  return map;
}

TEST(GuidedMatching, FindsVisiblePointsAtTheirProjections) {
  const MapSnapshot wall = MakeWall();
  ASSERT_EQ(Validate(wall), "");
  ASSERT_GT(wall.points.size(), 200u);
  Map map(wall);
  PointSearcher searcher;
  const int found = MatchMapPoints({}, 1, &searcher, &map);
  EXPECT_GT(found, static_cast<int>(wall.points.size()) * 3 / 4);
  const auto after = map.Snapshot();
  int added = 0;
  for (const Observation& observation : after->observations) {
    if (observation.keyframe != 1) continue;
    const Eigen::Vector2f truth =
        wall.FindPoint(observation.point)->source_pixel - Eigen::Vector2f(kShift, 0);
    EXPECT_LT((observation.pixel - truth).norm(), 0.5f);
    ++added;
  }
  EXPECT_EQ(added, found);
  EXPECT_EQ(Validate(*after), "");
  EXPECT_EQ(MatchMapPoints({}, 1, &searcher, &map), 0) << "every match is already an observation";
  EXPECT_EQ(MatchMapPoints({}, 7, &searcher, &map), 0) << "no such keyframe";
}

TEST(GuidedMatching, FindsNothingInAKeyFrameOfAnotherView) {
  MapSnapshot wall = MakeWall();
  cv::Mat other(240, 320, CV_8UC1);
  cv::RNG random(77);
  random.fill(other, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(other, other, {}, 1.5);
  cv::normalize(other, other, 0, 255, cv::NORM_MINMAX);
  wall.keyframes[1].features = MakeFeatures(other);
  Map map(wall);
  PointSearcher searcher;
  EXPECT_LT(MatchMapPoints({}, 1, &searcher, &map), static_cast<int>(wall.points.size()) / 20);
}

}  // namespace
}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#include "engine/map/map_snapshot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <utility>

#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

// Two keyframes with ids 2 and 5, which differ by a rotation, and two points that both observe: 3 (finite)
// and 7 (infinite).
MapSnapshot GoodMap() {
  MapSnapshot map;
  auto features = std::make_shared<ImageFeatures>();
  for (int level = 0; level < kPyramidLevels; ++level)
    features->levels[static_cast<std::size_t>(level)] =
        cv::Mat(48 >> level, 64 >> level, CV_8UC1, cv::Scalar(0));
  for (const KeyFrameId id : {2u, 5u}) {
    KeyFrame keyframe;
    keyframe.id = id;
    keyframe.camera = testing_world::PinholeCamera(64, 48);
    keyframe.features = features;
    keyframe.panorama = 1;
    keyframe.kind = id == 2 ? KeyFrameKind::kSixDof : KeyFrameKind::kPanorama;
    map.keyframes.push_back(keyframe);
  }
  map.panoramas = {{1, 2}};
  map.next_panorama = 2;
  for (const MapPointId id : {3u, 7u}) {
    MapPoint point;
    point.id = id;
    point.point_in_map = id == 3 ? Eigen::Vector4d(0.1, 0.2, 2, 1) : Eigen::Vector4d(0, 0.6, 0.8, 0);
    if (id == 7) point.panorama = 1;
    point.source_keyframe = 2;
    point.source_level = 1;
    point.source_pixel = {31, 23};
    map.points.push_back(point);
  }
  for (const KeyFrameId keyframe : {2u, 5u})
    for (const MapPointId point : {3u, 7u}) map.observations.push_back({keyframe, point, {63, 47}, 1});
  map.next_keyframe = 6;
  map.next_point = 8;
  return map;
}

void ExpectValidationError(const std::function<void(MapSnapshot*)>& damage, const std::string& about) {
  MapSnapshot map = GoodMap();
  damage(&map);
  EXPECT_THAT(Validate(map), HasSubstr(about));
}

TEST(MapSnapshot, IsValidUnmodifiedAndEmpty) {
  EXPECT_EQ(Validate(GoodMap()), "");
  EXPECT_EQ(Validate(MapSnapshot()), "");
}

TEST(MapSnapshot, FindsItemsByIdAndReturnsNullForMissingOnes) {
  const MapSnapshot map = GoodMap();
  EXPECT_EQ(map.FindKeyFrame(5), &map.keyframes[1]);
  EXPECT_EQ(map.FindPoint(3), &map.points[0]);
  for (const std::uint32_t id : {0u, 4u, 6u, 8u, kNoId}) {
    EXPECT_EQ(map.FindKeyFrame(id), nullptr);
    EXPECT_EQ(map.FindPoint(id), nullptr);
  }
}

TEST(MapSnapshot, ValidateNamesTheInvalidPanoramaMap) {
  ExpectValidationError([](MapSnapshot* m) { m->next_panorama = 1; }, "panorama map 1 is out of order");
  ExpectValidationError([](MapSnapshot* m) { m->panoramas.push_back(m->panoramas[0]); },
                        "panorama map 1 is out of order");
  ExpectValidationError([](MapSnapshot* m) { m->panoramas[0].reference = 4; }, "missing reference keyframe");
  ExpectValidationError([](MapSnapshot* m) { m->panoramas[0].reference = 5; }, "does not belong to it");
  ExpectValidationError([](MapSnapshot* m) { m->keyframes[1].panorama = kNoId; },
                        "keyframe 5 refers to a missing panorama map");
  ExpectValidationError([](MapSnapshot* m) { m->keyframes[1].panorama = 0; },
                        "keyframe 5 refers to a missing panorama map");
  ExpectValidationError([](MapSnapshot* m) { m->points[1].panorama = kNoId; },
                        "point 7 refers to a missing panorama map");
  ExpectValidationError([](MapSnapshot* m) { m->points[0].panorama = 1; },
                        "point 3 refers to a missing panorama map");
}

TEST(MapSnapshot, ValidateNamesTheInvalidKeyframe) {
  ExpectValidationError([](MapSnapshot* m) { std::swap(m->keyframes[0], m->keyframes[1]); },
                        "keyframe 2 is out of order");
  ExpectValidationError([](MapSnapshot* m) { m->keyframes[1].id = 2; }, "keyframe 2 is out of order");
  ExpectValidationError([](MapSnapshot* m) { m->next_keyframe = 5; }, "keyframe 5 is out of order");
  ExpectValidationError([](MapSnapshot* m) { m->keyframes[1].camera.reset(); }, "keyframe 5 has no camera");
  ExpectValidationError([](MapSnapshot* m) { m->keyframes[1].features.reset(); }, "keyframe 5 has no image");
  ExpectValidationError([](MapSnapshot* m) { m->keyframes[1].features = std::make_shared<ImageFeatures>(); },
                        "keyframe 5 has no image");
  ExpectValidationError([](MapSnapshot* m) { m->keyframes[1].camera = testing_world::PinholeCamera(48, 64); },
                        "keyframe 5 has an image whose size differs");
  ExpectValidationError([](MapSnapshot* m) { m->keyframes[0].camera_from_map.translation.y() = kNan; },
                        "keyframe 2 has no valid pose");
  ExpectValidationError(
      [](MapSnapshot* m) {
        m->keyframes[0].camera_from_map.rotation = Rotation3(Eigen::Quaterniond(0, 0, 0, 0));
      },
      "keyframe 2 has no valid pose");
  for (const double depth : {0.0, -1.0, kNan, std::numeric_limits<double>::infinity()})
    ExpectValidationError([&](MapSnapshot* m) { m->keyframes[0].mean_depth = depth; },
                          "keyframe 2 has no valid depth");
  for (const double sigma : {-1.0, kNan, std::numeric_limits<double>::infinity()})
    ExpectValidationError([&](MapSnapshot* m) { m->keyframes[0].depth_sigma = sigma; },
                          "keyframe 2 has no valid depth");
}

TEST(MapSnapshot, ValidateNamesTheInvalidPoint) {
  ExpectValidationError([](MapSnapshot* m) { std::swap(m->points[0], m->points[1]); },
                        "point 3 is out of order");
  ExpectValidationError([](MapSnapshot* m) { m->points[1].id = 3; }, "point 3 is out of order");
  ExpectValidationError([](MapSnapshot* m) { m->next_point = 7; }, "point 7 is out of order");
  ExpectValidationError([](MapSnapshot* m) { m->points[0].point_in_map.x() = kNan; },
                        "point 3 has no valid position");
  ExpectValidationError([](MapSnapshot* m) { m->points[0].point_in_map[3] = 0.5; },
                        "point 3 has no valid position");
  ExpectValidationError([](MapSnapshot* m) { m->points[0].normal.z() = std::nanf(""); },
                        "point 3 has no valid normal");
  ExpectValidationError([](MapSnapshot* m) { m->points[1].source_keyframe = 3; },
                        "point 7 refers to a missing source keyframe");
  ExpectValidationError([](MapSnapshot* m) { m->points[1].source_level = kPyramidLevels; },
                        "point 7 refers to a missing pyramid level");
  for (const Eigen::Vector2f& pixel : {Eigen::Vector2f(31.5f, 5), Eigen::Vector2f(5, 23.5f),
                                       Eigen::Vector2f(-1, 5), Eigen::Vector2f(std::nanf(""), 5)}) {
    ExpectValidationError([&](MapSnapshot* m) { m->points[1].source_pixel = pixel; },
                          "point 7 has its source outside the image");
  }
}

TEST(MapSnapshot, ValidateNamesAnInfinitePointWithoutAUnitDirection) {
  ExpectValidationError([](MapSnapshot* m) { m->points[1].point_in_map.setZero(); },
                        "point 7 has no valid position");
  ExpectValidationError([](MapSnapshot* m) { m->points[1].point_in_map *= 3; },
                        "point 7 has no valid position");
}

TEST(MapSnapshot, ValidateNamesTheInvalidObservation) {
  const std::string last = "observation of point 7 in keyframe 5";
  ExpectValidationError([](MapSnapshot* m) { std::swap(m->observations[2], m->observations[3]); },
                        "observation of point 3 in keyframe 5 is out of order");
  ExpectValidationError([](MapSnapshot* m) { m->observations.push_back(m->observations.back()); },
                        last + " is out of order");
  ExpectValidationError([](MapSnapshot* m) { m->observations[3].keyframe = 6; },
                        "observation of point 7 in keyframe 6 refers to a missing keyframe");
  ExpectValidationError([](MapSnapshot* m) { m->observations[3].point = 8; },
                        "observation of point 8 in keyframe 5 refers to a missing point");
  ExpectValidationError([](MapSnapshot* m) { m->observations[3].level = 4; },
                        last + " refers to a missing pyramid level");
  for (const Eigen::Vector2f& pixel : {Eigen::Vector2f(63.5f, 5), Eigen::Vector2f(5, 47.5f),
                                       Eigen::Vector2f(-0.5f, 5), Eigen::Vector2f(5, std::nanf(""))}) {
    ExpectValidationError([&](MapSnapshot* m) { m->observations[3].pixel = pixel; }, last + " lies outside");
  }
}

}  // namespace
}  // namespace docent::engine

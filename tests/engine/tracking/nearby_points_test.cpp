// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/nearby_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::CameraAt;

// A wall of points two metres ahead, observed by three keyframes. The first one is the source of all points.
class NearbyPointsOfAWall : public ::testing::Test {
 protected:
  NearbyPointsOfAWall() {
    for (int y = -2; y <= 2; ++y) {
      for (int x = -3; x <= 3; ++x) {
        MapPoint point;
        point.id = static_cast<MapPointId>(map_.points.size());
        point.point_in_map << 0.1 * x, 0.1 * y, 2, 1;
        point.source_keyframe = 0;
        map_.points.push_back(point);
      }
    }
    map_.next_point = static_cast<MapPointId>(map_.points.size());
    // One keyframe from the front, one half a metre in front of the wall, and one from the side.
    AddKeyFrame(CameraAt({0, 0, 0}), 0);
    AddKeyFrame(CameraAt({0, 0, 1.5}), 1);
    AddKeyFrame(Rigid3(Rotation3::Exp({0, 0.7, 0}), {0, 0, 0}) * CameraAt({1.5, 0, 0.2}), 0);
    map_.revision = 1;
  }

  void AddKeyFrame(const Rigid3& camera_from_map, std::uint8_t level) {
    KeyFrame keyframe;
    keyframe.id = map_.next_keyframe++;
    keyframe.camera = camera_;
    keyframe.camera_from_map = camera_from_map;
    keyframe.mean_depth = 2;
    for (MapPoint& point : map_.points) {
      const auto pixel = camera_->Project(camera_from_map * point.position());
      if (!pixel || !camera_->IsInside(*pixel)) continue;
      map_.observations.push_back({keyframe.id, point.id, pixel->cast<float>(), level});
      if (keyframe.id == 0) point.source_pixel = pixel->cast<float>();
    }
    map_.keyframes.push_back(keyframe);
  }

  std::set<KeyFrameId> SourcesFrom(const Rigid3& camera_from_map) {
    nearby_.ForgetLastFrame();
    nearby_.Update(map_, camera_from_map, {}, kNoId, Eigen::Vector3d::Zero());
    std::set<KeyFrameId> sources;
    for (const NearbyPoint& point : nearby_.finite()) {
      EXPECT_EQ(point.source->id, point.point->source_keyframe);
      sources.insert(point.source->id);
    }
    return sources;
  }

  std::shared_ptr<const CameraModel> camera_ = testing_world::PinholeCamera(640, 480);
  MapSnapshot map_;
  NearbyPoints nearby_{NearbyPointOptions{}};
};

TEST_F(NearbyPointsOfAWall, AreAllPointsThatItsKeyframesObserve) {
  SourcesFrom(CameraAt({0, 0, 0.1}));
  ASSERT_EQ(nearby_.finite().size(), map_.points.size());
  for (std::size_t i = 0; i < map_.points.size(); ++i) {
    EXPECT_EQ(nearby_.finite()[i].point->id, map_.points[i].id);
    EXPECT_EQ(nearby_.finite()[i].point_in_map, map_.points[i].point_in_map);
  }
}

TEST_F(NearbyPointsOfAWall, UseTheirSourceViewWhereItSuffices) {
  EXPECT_EQ(SourcesFrom(CameraAt({0, 0, 0})), std::set<KeyFrameId>{0});
  EXPECT_EQ(SourcesFrom(CameraAt({0.2, 0.1, 0.1})), std::set<KeyFrameId>{0});
}

TEST_F(NearbyPointsOfAWall, UseACloserViewWhereItFitsBetter) {
  const std::set<KeyFrameId> sources = SourcesFrom(CameraAt({0, 0, 1.45}));
  EXPECT_TRUE(sources.contains(1));
  for (const NearbyPoint& point : nearby_.finite()) {
    if (point.source->id != 1) continue;
    const auto pixel = camera_->Project(map_.keyframes[1].camera_from_map * point.point->position());
    EXPECT_EQ(point.point->source_level, 1);
    EXPECT_LT((point.point->source_pixel.cast<double>() - LevelFromLevelZero(*pixel, 1)).norm(), 1e-3);
  }
  EXPECT_TRUE(SourcesFrom(map_.keyframes[2].camera_from_map).contains(2));
}

TEST_F(NearbyPointsOfAWall, DoNotUseViewsWithLargeReprojectionErrors) {
  for (Observation& observation : map_.observations) {
    if (observation.keyframe == 1) observation.pixel.x() += 2.5f;  // a pixel of its level is two pixels wide
  }
  EXPECT_FALSE(SourcesFrom(CameraAt({0, 0, 1.45})).contains(1));
}

TEST_F(NearbyPointsOfAWall, AreUpdatedWhenTheMapHasChanged) {
  SourcesFrom(CameraAt({0, 0, 0}));
  map_.points.pop_back();
  ++map_.revision;
  nearby_.Update(map_, CameraAt({0, 0, 0}), {0, 1, 2}, kNoId, Eigen::Vector3d::Zero());
  EXPECT_EQ(nearby_.finite().size(), map_.points.size());
}

TEST_F(NearbyPointsOfAWall, WithoutDepthComeFromTheGivenPanoramaOnly) {
  map_.panoramas = {{0, 0}, {1, 1}};
  map_.keyframes[0].panorama = 0;
  map_.keyframes[1].panorama = 1;
  map_.keyframes[1].camera_from_map = CameraAt({0, 0, 1});
  for (MapPoint& point : map_.points) {
    point.point_in_map = Eigen::Vector4d(point.position().normalized().homogeneous());
    point.point_in_map[3] = 0;
    point.panorama = point.id % 2;
    point.source_keyframe = point.panorama;
  }
  nearby_.Update(map_, CameraAt({0, 0, 0}), {}, 1, Eigen::Vector3d::Zero());
  EXPECT_TRUE(nearby_.finite().empty());
  ASSERT_FALSE(nearby_.infinite().empty());
  for (const NearbyPoint& point : nearby_.infinite()) {
    EXPECT_EQ(point.point->panorama, 1u);
    EXPECT_EQ(point.point_in_map[3], 0);
  }
  // With a pivot off the camera centre, infinite points get the median depth of the reference keyframe.
  nearby_.Update(map_, CameraAt({0, 0, 0}), {}, 1, Eigen::Vector3d(0, 0, -0.2));
  for (const NearbyPoint& point : nearby_.infinite()) {
    const Eigen::Vector3d place = point.point_in_map.head<3>() / point.point_in_map[3];
    EXPECT_NEAR((place - Eigen::Vector3d(0, 0, 1)).norm(), map_.keyframes[1].mean_depth, 1e-9);
  }
}

}  // namespace
}  // namespace docent::engine

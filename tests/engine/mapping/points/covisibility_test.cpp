// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/points/covisibility.h"

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <vector>

#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

KeyFrameId AddKeyFrameOfKind(KeyFrameKind kind, double x, Map* map) {
  static const auto features = std::make_shared<const ImageFeatures>();
  KeyFrame keyframe;
  keyframe.kind = kind;
  keyframe.camera = testing_world::PinholeCamera(640, 480);
  keyframe.features = features;
  keyframe.camera_from_map = testing_world::CameraAt({x, 0, 0});
  return map->AddKeyFrame(keyframe).keyframe.id;
}

void AddPointSeenBy(const std::vector<KeyFrameId>& observers, Map* map) {
  MapPoint point;
  point.point_in_map = {0, 0, 2, 1};
  point.source_keyframe = observers.front();
  const MapPointId id = map->AddPoint(point);
  for (const KeyFrameId observer : observers) map->AddObservation({observer, id, {320, 240}, 0});
}

TEST(Covisibility, CountsThePointsThatTwoKeyFramesShare) {
  Map map;
  const KeyFrameId a = AddKeyFrameOfKind(KeyFrameKind::kSixDof, 0, &map);
  const KeyFrameId b = AddKeyFrameOfKind(KeyFrameKind::kSixDof, 1, &map);
  const KeyFrameId c = AddKeyFrameOfKind(KeyFrameKind::kSixDof, 3, &map);
  for (int i = 0; i < 20; ++i) AddPointSeenBy({a, b}, &map);
  for (int i = 0; i < 5; ++i) AddPointSeenBy({b, c}, &map);
  const Covisibility sharing(map);
  EXPECT_EQ(sharing.Shared(0, 1), 20);
  EXPECT_EQ(sharing.Shared(1, 2), 5);
  EXPECT_EQ(sharing.Shared(0, 2), 0);
  EXPECT_TRUE(sharing.AreNeighbours(0, 1));
  EXPECT_FALSE(sharing.AreNeighbours(1, 2)) << "five shared points are no evidence";
  EXPECT_NEAR(sharing.PathLengthBetween(a, b, map), 1, 1e-12);
  EXPECT_EQ(sharing.PathLengthBetween(a, c, map), std::numeric_limits<double>::infinity());
}

// No map should have such an observation, but one that has must not be counted for another keyframe.
TEST(Covisibility, IgnoresFinitePointsSeenByPanoramaKeyFrames) {
  Map map;
  const KeyFrameId a = AddKeyFrameOfKind(KeyFrameKind::kSixDof, 0, &map);
  const KeyFrameId b = AddKeyFrameOfKind(KeyFrameKind::kSixDof, 1, &map);
  const KeyFrameId panorama = AddKeyFrameOfKind(KeyFrameKind::kPanorama, 0, &map);
  for (int i = 0; i < 30; ++i) AddPointSeenBy({a, panorama}, &map);
  const Covisibility sharing(map);
  EXPECT_EQ(sharing.keyframes(), (std::vector<KeyFrameId>{a, b}));
  EXPECT_EQ(sharing.Shared(0, 1), 0);
  EXPECT_EQ(sharing.Shared(1, 0), 0);
  EXPECT_EQ(sharing.PathLengthBetween(a, b, map), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace docent::engine

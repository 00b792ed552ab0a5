// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/points/keyframe_culling.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::Camera;
using testing_world::CameraAt;

// In front of one wall: keyframes at these lateral positions, all of which see the same points.
Map MapWithKeyFramesAt(const std::vector<double>& places) {
  static const auto world = testing_world::RenderedWorld::SingleWall(3, 5);
  std::vector<Rigid3> poses;
  for (const double x : places) poses.push_back(CameraAt({x, 0, 0}));
  Map map = testing_world::TrueMap(world, Camera(), poses, 60);
  for (auto& [id, record] : map.keyframes()) map.UpdateDepth(&record);
  return map;
}

KeyFrameId Newest(const Map& map) {
  return map.keyframes().rbegin()->first;
}

TEST(KeyFrameCulling, FindsAKeyFrameAmongManyWithTheSameView) {
  Map map = MapWithKeyFramesAt({0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9});
  const KeyFrameId redundant = FindRedundantKeyFrame({}, Newest(map), &map);
  ASSERT_NE(redundant, kNoId);
  EXPECT_FALSE(map.FindKeyFrame(redundant)->keyframe.fixed);
  EXPECT_LT(redundant, Newest(map));
}

TEST(KeyFrameCulling, KeepsKeyFramesWithoutNeighbours) {
  // Six tenths of a metre apart, three metres from a wall: others observe the points, but have no similar
  // view.
  Map map = MapWithKeyFramesAt({0, 0.6, 1.2, 1.8, 2.4, 3.0, 3.6, 4.2, 4.8, 5.4});
  EXPECT_EQ(FindRedundantKeyFrame({}, Newest(map), &map), kNoId);
  KeyFrameCullingOptions farther;
  farther.max_distance = 0.25;
  EXPECT_NE(FindRedundantKeyFrame(farther, Newest(map), &map), kNoId);
}

TEST(KeyFrameCulling, KeepsSmallMaps) {
  Map small = MapWithKeyFramesAt({0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7});
  EXPECT_EQ(FindRedundantKeyFrame({}, Newest(small), &small), kNoId);
  KeyFrameCullingOptions smaller;
  smaller.min_keyframes = 7;
  EXPECT_NE(FindRedundantKeyFrame(smaller, Newest(small), &small), kNoId);
}

TEST(KeyFrameCulling, KeepsFixedKeyFramesAndReferences) {
  Map map = MapWithKeyFramesAt({0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9});
  const KeyFrameId redundant = FindRedundantKeyFrame({}, Newest(map), &map);
  ASSERT_NE(redundant, kNoId);
  for (auto& [id, record] : map.keyframes())
    if (id != redundant) record.keyframe.fixed = true;
  EXPECT_EQ(FindRedundantKeyFrame({}, Newest(map), &map), redundant)
      << "it is the only one that is not fixed";
  map.FindKeyFrame(redundant)->keyframe.fixed = true;
  EXPECT_EQ(FindRedundantKeyFrame({}, Newest(map), &map), kNoId);
  map.FindKeyFrame(redundant)->keyframe.fixed = false;
  map.OpenPanorama(redundant);
  EXPECT_EQ(FindRedundantKeyFrame({}, Newest(map), &map), kNoId);
}

TEST(KeyFrameCulling, TheOldestKeyFrameIsNoReferenceOfOthers) {
  Map map = MapWithKeyFramesAt({0, 0.1, 0.2});
  EXPECT_EQ(FindOldestKeyFrame(Newest(map), map), 1u) << "the first one is fixed";
  const PanoramaId panorama = map.OpenPanorama(1);
  EXPECT_EQ(FindOldestKeyFrame(Newest(map), map), 1u) << "no other keyframe needs it";
  KeyFrame dependent = map.FindKeyFrame(1)->keyframe;
  dependent.kind = KeyFrameKind::kPanorama;
  const KeyFrameId first = map.AddKeyFrame(dependent).keyframe.id;
  map.AddKeyFrame(dependent);
  ASSERT_EQ(dependent.panorama, panorama);
  EXPECT_EQ(FindOldestKeyFrame(Newest(map), map), 2u);
  map.FindKeyFrame(2)->keyframe.fixed = true;
  EXPECT_EQ(FindOldestKeyFrame(Newest(map), map), first);
  for (auto& [id, record] : map.keyframes()) record.keyframe.fixed = true;
  EXPECT_EQ(FindOldestKeyFrame(Newest(map), map), kNoId);
}

TEST(KeyFrameCulling, TheOldestKeyFrameIsNotTheOneThatWasJustAdded) {
  Map map = MapWithKeyFramesAt({0, 0.1, 0.2});
  map.OpenPanorama(1);
  KeyFrame dependent = map.FindKeyFrame(1)->keyframe;
  dependent.kind = KeyFrameKind::kPanorama;
  const KeyFrameId only = map.AddKeyFrame(dependent).keyframe.id;
  EXPECT_EQ(FindOldestKeyFrame(only, map), 2u) << "a camera that came back and turns needs its new keyframe";
  map.FindKeyFrame(2)->keyframe.fixed = true;
  EXPECT_EQ(FindOldestKeyFrame(only, map), kNoId);
}

TEST(KeyFrameCulling, KeepsEnoughObserversOfEveryPoint) {
  Map map = MapWithKeyFramesAt({0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1});
  const std::size_t points = map.AlivePoints();
  int removed = 0;
  for (KeyFrameId id = 0; (id = FindRedundantKeyFrame({}, Newest(map), &map)) != kNoId; ++removed)
    CullKeyFrame(id, &map);
  EXPECT_EQ(removed, 4) << "down to the eight that every map keeps";
  EXPECT_GT(map.AlivePoints(), points * 98 / 100) << "only points of a single keyframe are removed with it";
  const auto snapshot = map.Snapshot();
  EXPECT_EQ(Validate(*snapshot), "");
  for (const MapPoint& point : snapshot->points) {
    const KeyFrame* source = snapshot->FindKeyFrame(point.source_keyframe);
    ASSERT_NE(source, nullptr);
    // The new source observes the point where the point projects.
    const auto pixel = source->camera->Project(source->camera_from_map * point.position());
    ASSERT_TRUE(pixel);
    const Eigen::Vector2d seen = LevelZeroFromLevel(point.source_pixel.cast<double>(), point.source_level);
    EXPECT_LT((*pixel - seen).norm(), 1e-3);
  }
}

}  // namespace
}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/points/map_descriptors.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::CameraAt;
using testing_world::RenderedWorld;

class MapDescriptorsTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    camera_ = testing_world::PinholeCamera(480, 360);
    world_ = std::make_unique<RenderedWorld>(RenderedWorld::Room(4));
  }
  static Map TrueMap() {
    return testing_world::TrueMap(*world_, camera_,
                                  {CameraAt({0, 0, 0}), CameraAt({0.25, 0, 0}), CameraAt({0.1, 0.15, 0.1})});
  }
  static void Update(MapDescriptors* descriptors, Map* map) {
    for (int i = 0; descriptors->UpdateOne({}, map); ++i) ASSERT_LT(i, 100);
  }
  static std::shared_ptr<const CameraModel> camera_;
  static std::unique_ptr<RenderedWorld> world_;
};
std::shared_ptr<const CameraModel> MapDescriptorsTest::camera_;
std::unique_ptr<RenderedWorld> MapDescriptorsTest::world_;

TEST_F(MapDescriptorsTest, EstimateThePoseOfAnImageWhosePoseIsFarOff) {
  Map map = TrueMap();
  MapDescriptors descriptors(DefaultVocabulary());
  Update(&descriptors, &map);
  const Rigid3 truth = CameraAt({0.12, 0.05, 0.05}, {3, 4, 8});
  KeyFrame keyframe = testing_world::MakeKeyFrame(*world_, camera_, truth);
  keyframe.camera_from_map = CameraAt({3, 0, -2}, {0, 120, 0});  // a wrong pose: no point is in view
  const auto pose = descriptors.SuggestPose({}, keyframe, 1, &map);
  ASSERT_TRUE(pose);
  EXPECT_LT((pose->OriginInSource() - truth.OriginInSource()).norm(), 0.03);
  EXPECT_LT((pose->rotation * truth.rotation.inverse()).Angle(), 0.02);
}

TEST_F(MapDescriptorsTest, ReturnNoPoseForAnotherPlace) {
  Map map = TrueMap();
  MapDescriptors descriptors(DefaultVocabulary());
  Update(&descriptors, &map);
  const RenderedWorld elsewhere = RenderedWorld::Room(77);
  const KeyFrame keyframe = testing_world::MakeKeyFrame(elsewhere, camera_, CameraAt({0, 0, 0}));
  EXPECT_FALSE(descriptors.SuggestPose({}, keyframe, 1, &map));
}

TEST_F(MapDescriptorsTest, FollowEveryChangeOfTheMap) {
  Map map = TrueMap();
  MapDescriptors grown(DefaultVocabulary());
  Update(&grown, &map);
  EXPECT_GT(grown.database().size(), 100u);
  // After points and keyframes are removed, the database equals one that never contained them.
  for (MapPointId id = 0; id < map.points().size(); id += 3) map.RemovePoint(id);
  map.RemoveKeyFrame(map.keyframes().rbegin()->first);
  Update(&grown, &map);
  MapDescriptors fresh(DefaultVocabulary());
  Update(&fresh, &map);
  EXPECT_TRUE(grown.database() == fresh.database());
  EXPECT_FALSE(grown.UpdateOne({}, &map));
}

}  // namespace
}  // namespace docent::engine

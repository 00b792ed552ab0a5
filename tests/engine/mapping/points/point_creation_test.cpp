// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/points/point_creation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <tuple>
#include <vector>

#include "engine/geometry/triangulation.h"
#include "tests/engine/geometry/test_math.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::CameraAt;
using testing_world::RenderedWorld;

class CreatePointsTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    world_ = new RenderedWorld(RenderedWorld::Room(41));
    camera_ = testing_world::PinholeCamera(480, 360);
  }
  static void TearDownTestSuite() {
    delete world_;
    world_ = nullptr;
    camera_.reset();
  }
  // Keyframes without points, for which only the median depth is known.
  static Map WithoutPoints(const std::vector<Rigid3>& poses) {
    Map map;
    for (const Rigid3& pose : poses) {
      KeyFrame keyframe = testing_world::MakeKeyFrame(*world_, camera_, pose);
      keyframe.mean_depth = 2.5;
      keyframe.depth_sigma = 0.5;
      map.AddKeyFrame(std::move(keyframe));
    }
    return map;
  }
  static std::vector<double> DistancesToSurface(Map* map, const std::vector<MapPointId>& points) {
    std::vector<double> distances;
    for (const MapPointId id : points)
      distances.push_back(world_->DistanceToSurface(map->FindPoint(id)->point.position()));
    std::sort(distances.begin(), distances.end());
    return distances;
  }

  static RenderedWorld* world_;
  static std::shared_ptr<const CameraModel> camera_;
};
RenderedWorld* CreatePointsTest::world_ = nullptr;
std::shared_ptr<const CameraModel> CreatePointsTest::camera_;

TEST_F(CreatePointsTest, CreatesThemOnTheWalls) {
  for (const Rigid3& other : {CameraAt({0.3, 0, 0}), CameraAt({-0.1, 0.2, 0.1}, {2, 3, 10})}) {
    Map map = WithoutPoints({CameraAt({0, 0, 0}), other});
    PointSearcher searcher;
    const auto created = CreatePoints({}, 0, 1, &map, &searcher);
    ASSERT_GT(created.size(), 80u);
    const auto distances = DistancesToSurface(&map, created);
    EXPECT_LT(distances[distances.size() / 2], 0.012);
    EXPECT_LT(distances[distances.size() * 9 / 10], 0.08);
    EXPECT_EQ(Validate(*map.Snapshot()), "");
  }
}

TEST_F(CreatePointsTest, AddsObservationsInBothKeyframesAtTheProjections) {
  Map map = WithoutPoints({CameraAt({0, 0, 0}), CameraAt({0.3, 0, 0})});
  PointSearcher searcher;
  const PointCreationOptions options;
  const auto created = CreatePoints(options, 0, 1, &map, &searcher);
  const double least_parallax = Radians(options.min_parallax_deg);
  for (const MapPointId id : created) {
    const Map::PointRecord* record = map.FindPoint(id);
    ASSERT_NE(record, nullptr);
    EXPECT_EQ(record->observers, (std::vector<KeyFrameId>{0, 1}));
    EXPECT_EQ(record->point.source_keyframe, 0u);
    EXPECT_NEAR(record->point.normal.norm(), 1, 1e-5);
    EXPECT_LT(record->point.normal.z(), 0);
    EXPECT_GE(ParallaxAngle({0, 0, 0}, {0.3, 0, 0}, record->point.position()), 0.99 * least_parallax);
  }
  for (const auto& [keyframe, record] : map.keyframes()) {
    EXPECT_EQ(record.observations.size(), created.size());
    for (const Observation& observation : record.observations) {
      const auto pixel = camera_->Project(record.keyframe.camera_from_map *
                                          map.FindPoint(observation.point)->point.position());
      ASSERT_TRUE(pixel);
      EXPECT_LT((observation.pixel.cast<double>() - *pixel).norm(), 2.01 * (1 << observation.level));
    }
  }
}

TEST_F(CreatePointsTest, CreatesNoneWithoutParallax) {
  PointSearcher searcher;
  for (const Rigid3& other : {CameraAt({0, 0, 0}, {0, 4, 2}), CameraAt({0.004, 0, 0}), CameraAt({0, 0, 0})}) {
    Map map = WithoutPoints({CameraAt({0, 0, 0}), other});
    EXPECT_TRUE(CreatePoints({}, 0, 1, &map, &searcher).empty());
    EXPECT_EQ(map.AlivePoints(), 0u);
    searcher.Clear();
  }
}

TEST_F(CreatePointsTest, CreatesNoDuplicatesAndTerminates) {
  Map map = WithoutPoints({CameraAt({0, 0, 0}), CameraAt({0.3, 0, 0})});
  PointSearcher searcher;
  std::set<std::tuple<int, float, float>> corners;
  std::size_t created = 1;
  for (int round = 0; round < 12 && created > 0; ++round) {
    const auto points = CreatePoints({}, 0, 1, &map, &searcher);
    created = points.size();
    for (const MapPointId id : points) {
      const MapPoint& point = map.FindPoint(id)->point;
      EXPECT_TRUE(corners.emplace(point.source_level, point.source_pixel.x(), point.source_pixel.y()).second);
    }
  }
  EXPECT_EQ(created, 0u);
  EXPECT_GT(corners.size(), 200u);
}

TEST_F(CreatePointsTest, CreatesNoneForKeyframesThatDoNotExist) {
  Map map = WithoutPoints({CameraAt({0, 0, 0}), CameraAt({0.3, 0, 0})});
  PointSearcher searcher;
  EXPECT_TRUE(CreatePoints({}, 0, 0, &map, &searcher).empty());
  EXPECT_TRUE(CreatePoints({}, 0, 9, &map, &searcher).empty());
  EXPECT_TRUE(CreatePoints({}, 9, 0, &map, &searcher).empty());
}

// The searcher caches patches of points by id; the patches of one pair must not affect the next.
TEST_F(CreatePointsTest, DoesNotDependOnEarlierPairs) {
  const std::vector<Rigid3> poses = {CameraAt({0, 0, 0}), CameraAt({0.3, 0, 0}),
                                     CameraAt({0.1, 0.15, 0}, {0, 20, 90})};
  Map used = WithoutPoints(poses), fresh = WithoutPoints(poses);
  PointSearcher used_searcher, fresh_searcher;
  PointSearcher other_searcher;
  CreatePoints({}, 2, 1, &used, &used_searcher);
  CreatePoints({}, 2, 1, &fresh, &other_searcher);
  const auto after = CreatePoints({}, 0, 1, &used, &used_searcher);
  const auto alone = CreatePoints({}, 0, 1, &fresh, &fresh_searcher);
  ASSERT_EQ(after.size(), alone.size());
  for (std::size_t i = 0; i < after.size(); ++i) {
    EXPECT_EQ(used.FindPoint(after[i])->point.source_pixel, fresh.FindPoint(alone[i])->point.source_pixel);
    EXPECT_EQ(used.FindPoint(after[i])->point.point_in_map, fresh.FindPoint(alone[i])->point.point_in_map);
  }
}

}  // namespace
}  // namespace docent::engine

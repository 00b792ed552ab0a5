// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <vector>

#include "engine/mapping/panorama/panorama_mapping.h"
#include "engine/mapping/points/point_creation.h"
#include "tests/engine/mapping/panorama/panorama_scene.h"

namespace docent::engine {
namespace {

using testing_world::CameraAt;
using testing_world::RenderedWorld;

// hybrid-slam §5.2: infinite points are triangulated and become finite.
class ConvertInfinitePointsTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    world_ = new RenderedWorld(testing_world::Chamber(91));
    camera_ = testing_world::PinholeCamera(480, 360);
  }
  static void TearDownTestSuite() {
    delete world_;
    world_ = nullptr;
    camera_.reset();
  }
  static KeyFrame Image(const Rigid3& pose) {
    KeyFrame keyframe = testing_world::MakeKeyFrame(*world_, camera_, pose);
    keyframe.mean_depth = 2.5;
    keyframe.depth_sigma = 0.5;
    return keyframe;
  }
  // Keyframe 0: the reference of a panorama map with many infinite points, at the origin. Keyframe 1: a
  // localized keyframe elsewhere.
  static Map Pair(const Rigid3& partner) {
    Map map;
    map.AddKeyFrame(Image(CameraAt({0, 0, 0})));
    map.OpenPanorama(0);
    EXPECT_GT(AddInfinitePoints({}, 0, {}, &map), 150);
    map.AddKeyFrame(Image(partner));
    return map;
  }
  // As in the mapper: more parallax than for an ordinary pair.
  static InfiniteConversion Convert(Map* map, KeyFrameId reference = 0, KeyFrameId partner = 1) {
    PointCreationOptions options;
    options.min_parallax_deg = 1.5;
    PointSearcher searcher;
    return ConvertInfinitePoints(options, reference, partner, map, &searcher);
  }

  static RenderedWorld* world_;
  static std::shared_ptr<const CameraModel> camera_;
};
RenderedWorld* ConvertInfinitePointsTest::world_ = nullptr;
std::shared_ptr<const CameraModel> ConvertInfinitePointsTest::camera_;

TEST_F(ConvertInfinitePointsTest, TriangulatesInfinitePointsOnTheWalls) {
  for (const Rigid3& partner : {CameraAt({0.3, 0, 0}), CameraAt({-0.2, 0.15, 0.1}, {2, 4, 8}),
                                CameraAt({0.25, 0, -0.2}, {0, -6, 0})}) {
    Map map = Pair(partner);
    const std::size_t before = map.AlivePoints();
    const InfiniteConversion conversion = Convert(&map);
    ASSERT_GT(conversion.converted.size(), 60u);
    // Infinite points of two levels may be one corner; no other finite point existed before.
    EXPECT_LT(conversion.merged, 10);
    EXPECT_EQ(map.AlivePoints(), before - static_cast<std::size_t>(conversion.merged));
    std::vector<double> distances;
    for (const MapPointId id : conversion.converted) {
      const Map::PointRecord& record = *map.FindPoint(id);
      EXPECT_FALSE(record.point.infinite());
      EXPECT_TRUE(record.point.was_infinite);
      EXPECT_EQ(record.point.panorama, kNoId);
      EXPECT_EQ(record.observers, (std::vector<KeyFrameId>{0, 1}));
      distances.push_back(world_->DistanceToSurface(record.point.position()));
    }
    std::sort(distances.begin(), distances.end());
    EXPECT_LT(distances[distances.size() / 2], 0.02);
    EXPECT_LT(distances[distances.size() * 9 / 10], 0.06);
    EXPECT_EQ(Validate(*map.Snapshot()), "");
    // A second call for the same pair finds no more than the first one left.
    EXPECT_LT(Convert(&map).converted.size(), conversion.converted.size() / 4 + 1);
  }
}

TEST_F(ConvertInfinitePointsTest, RejectsInsufficientParallax) {
  // A rotation, and a translation that causes less than 1.5 degrees of parallax at the nearest wall, 2.1
  // metres away.
  for (const Rigid3& partner : {CameraAt({0, 0, 0}, {0, 10, 0}), CameraAt({0.04, 0, 0})}) {
    Map map = Pair(partner);
    const InfiniteConversion conversion = Convert(&map);
    EXPECT_TRUE(conversion.converted.empty());
    EXPECT_EQ(conversion.merged, 0);
  }
}

// The partner's image was taken on the opposite side of its pose, so correct matches would lie behind both
// cameras.
TEST_F(ConvertInfinitePointsTest, RejectsPointsBehindTheCameras) {
  Map right = Pair(CameraAt({0.3, 0, 0})), wrong = Pair(CameraAt({0.3, 0, 0}));
  wrong.FindKeyFrame(1)->keyframe.camera_from_map = CameraAt({-0.3, 0, 0});
  const std::size_t possible = Convert(&right).converted.size();
  // By chance a few patches resemble a wrong one.
  EXPECT_LT(Convert(&wrong).converted.size(), possible / 8);
  for (const Map::PointRecord& record : wrong.points()) {
    if (!record.alive || record.point.infinite()) continue;
    for (const KeyFrameId id : record.observers)
      EXPECT_GT((wrong.FindKeyFrame(id)->keyframe.camera_from_map * record.point.position()).z(), 0);
  }
}

// The pose of the partner is wrong perpendicular to the baseline: hardly any match lies on its epipolar line.
TEST_F(ConvertInfinitePointsTest, RejectsMatchesOffTheEpipolarLine) {
  Map right = Pair(CameraAt({0.3, 0, 0})), wrong = Pair(CameraAt({0.3, 0, 0}));
  wrong.FindKeyFrame(1)->keyframe.camera_from_map = CameraAt({0.3, 0, 0}, {4, 0, 0});
  const std::size_t possible = Convert(&right).converted.size();
  EXPECT_LT(Convert(&wrong).converted.size(), possible / 6);
}

TEST_F(ConvertInfinitePointsTest, ConvertsOnlyPointsWhoseSourceIsTheReference) {
  Map map = Pair(CameraAt({0.3, 0, 0}));
  const Rigid3 rotated = CameraAt({0, 0, 0}, {0, 12, 0});
  const KeyFrameId dependent =
      map.AddKeyFrame(testing_world::MakeDependent(*world_, camera_, rotated, 0, {0, 0, 0})).keyframe.id;
  // The dependent keyframe observes the reference's infinite points, and has some of its own that the
  // reference observes.
  std::vector<MapPointId> own;
  for (const Map::PointRecord& record : map.points()) {
    const auto pixel = camera_->Project(rotated.rotation * record.point.position());
    if (pixel && camera_->IsInside(*pixel, 5))
      map.AddObservation({dependent, record.point.id, pixel->cast<float>(), record.point.source_level});
  }
  const std::vector<Map::PointRecord> points = map.points();
  for (const Map::PointRecord& record : points) {
    if (record.observers.size() < 2 || record.point.id % 3 != 0) continue;
    MapPoint point = record.point;
    point.source_keyframe = dependent;
    const Observation seen{0, 0, camera_->Project(point.position())->cast<float>(), point.source_level};
    map.RemovePoint(record.point.id);
    own.push_back(map.AddPoint(point));
    map.AddObservation({0, own.back(), seen.pixel, seen.level});
    map.AddObservation({dependent, own.back(),
                        camera_->Project(rotated.rotation * point.position())->cast<float>(), seen.level});
  }
  ASSERT_GT(own.size(), 10u);
  const InfiniteConversion conversion = Convert(&map);
  ASSERT_GT(conversion.converted.size(), 40u);
  for (const MapPointId id : own) EXPECT_TRUE(map.FindPoint(id)->point.infinite()) << id;
  // A dependent keyframe observes no finite points (hybrid-slam §2).
  for (const Observation& observation : map.FindKeyFrame(dependent)->observations)
    EXPECT_TRUE(map.FindPoint(observation.point)->point.infinite());
  EXPECT_EQ(Validate(*map.Snapshot()), "");
}

// The partner already observes the same corners as finite points, so no duplicate may be created.
TEST_F(ConvertInfinitePointsTest, CreatesNoDuplicateOfAFinitePoint) {
  Map map = Pair(CameraAt({0.3, 0, 0}));
  map.AddKeyFrame(Image(CameraAt({0.55, 0, 0})));
  PointSearcher searcher;
  const std::size_t known = CreatePoints({}, 1, 2, &map, &searcher).size();
  ASSERT_GT(known, 100u);
  const std::size_t before = map.AlivePoints();
  const InfiniteConversion conversion = Convert(&map);
  EXPECT_GT(conversion.merged, 20);
  EXPECT_GT(conversion.converted.size(), 10u);
  EXPECT_EQ(map.AlivePoints(), before - static_cast<std::size_t>(conversion.merged));
  int joined = 0;
  for (const Map::PointRecord& record : map.points()) {
    if (!record.alive || record.point.infinite() || record.point.was_infinite) continue;
    const auto& observations = map.FindKeyFrame(0)->observations;
    const auto seen = std::find_if(observations.begin(), observations.end(),
                                   [&](const Observation& o) { return o.point == record.point.id; });
    if (seen == observations.end()) continue;
    ++joined;
    EXPECT_LT((*camera_->Project(record.point.position()) - seen->pixel.cast<double>()).norm(),
              2.0 * (1 << seen->level) + 0.5);
  }
  // A few coincide with a point that was infinite itself, or with one that another point of the reference
  // matched.
  EXPECT_LE(joined, conversion.merged);
  EXPECT_GT(joined, 3 * conversion.merged / 4);
  // No two finite points at one pixel of the partner's image.
  const auto& observations = map.FindKeyFrame(1)->observations;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const bool converted = map.FindPoint(observations[i].point)->point.was_infinite ||
                             map.FindPoint(observations[j].point)->point.was_infinite;
      if (!converted || observations[i].level != observations[j].level) continue;
      EXPECT_GT((observations[i].pixel - observations[j].pixel).norm(), 1.5f * (1 << observations[i].level))
          << observations[i].point << " and " << observations[j].point;
    }
  }
  EXPECT_EQ(Validate(*map.Snapshot()), "");
}

TEST_F(ConvertInfinitePointsTest, DoesNothingForKeyframesThatDoNotExist) {
  Map map = Pair(CameraAt({0.3, 0, 0}));
  for (const auto& [reference, partner] :
       std::vector<std::pair<KeyFrameId, KeyFrameId>>{{0, 0}, {0, 9}, {9, 0}, {1, 0}}) {
    const InfiniteConversion conversion = Convert(&map, reference, partner);
    EXPECT_TRUE(conversion.converted.empty() && conversion.merged == 0) << reference << ", " << partner;
  }
  EXPECT_FALSE(Convert(&map, 0, 1).converted.empty()) << "these two exist";
}

}  // namespace
}  // namespace docent::engine

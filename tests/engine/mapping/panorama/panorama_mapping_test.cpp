// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/panorama/panorama_mapping.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <vector>

#include "engine/base/random.h"
#include "tests/engine/geometry/test_math.h"
#include "tests/engine/mapping/panorama/panorama_scene.h"

namespace docent::engine {
namespace {

using testing_world::BlankKeyFrame;
using testing_world::CameraAt;
using testing_world::RenderedWorld;

const Eigen::Vector3d kPanoramaCenter(0.1, -0.1, 0.2);

// Compares everything but the revision.
void ExpectSameMap(const MapSnapshot& a, const MapSnapshot& b) {
  ASSERT_EQ(a.keyframes.size(), b.keyframes.size());
  ASSERT_EQ(a.points.size(), b.points.size());
  ASSERT_EQ(a.observations.size(), b.observations.size());
  ASSERT_EQ(a.panoramas.size(), b.panoramas.size());
  EXPECT_EQ(a.next_panorama, b.next_panorama);
  EXPECT_EQ(a.next_point, b.next_point);
  for (std::size_t i = 0; i < a.keyframes.size(); ++i) {
    EXPECT_EQ(a.keyframes[i].kind, b.keyframes[i].kind);
    EXPECT_EQ(a.keyframes[i].panorama, b.keyframes[i].panorama);
    EXPECT_TRUE(testing_world::SamePose(a.keyframes[i].camera_from_map, b.keyframes[i].camera_from_map));
    EXPECT_EQ(a.keyframes[i].mean_depth, b.keyframes[i].mean_depth);
  }
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    EXPECT_EQ(a.points[i].id, b.points[i].id);
    EXPECT_EQ(a.points[i].point_in_map, b.points[i].point_in_map);
    EXPECT_EQ(a.points[i].panorama, b.points[i].panorama);
  }
  for (std::size_t i = 0; i < a.observations.size(); ++i) {
    EXPECT_EQ(a.observations[i].keyframe, b.observations[i].keyframe);
    EXPECT_EQ(a.observations[i].point, b.observations[i].point);
    EXPECT_EQ(a.observations[i].pixel, b.observations[i].pixel);
  }
}

class PanoramaMappingTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    world_ = new RenderedWorld(testing_world::Chamber(81));
    camera_ = testing_world::PinholeCamera(480, 360);
    // True finite points in the front of the room, seen from near its centre, where the panorama is taken.
    true_map_ = testing_world::TrueMap(*world_, camera_,
                                       {CameraAt({0, 0, 0}), CameraAt({0.35, 0, 0}, {0, 5, 0}),
                                        CameraAt({0.2, 0.1, 0.1}, {0, 25, 0})},
                                       250)
                    .Snapshot();
  }
  static void TearDownTestSuite() {
    delete world_;
    world_ = nullptr;
    camera_.reset();
    true_map_.reset();
  }
  // The true map and a panorama map whose reference sees no finite points.
  static Map MapWithPanorama() {
    Map map(*true_map_);
    reference_ =
        map.AddKeyFrame(testing_world::MakeKeyFrame(*world_, camera_, CameraAt(kPanoramaCenter, {0, 40, 0})))
            .keyframe.id;
    panorama_ = map.OpenPanorama(reference_);
    return map;
  }
  // Adds a dependent keyframe whose true position is off the centre that is assumed for it.
  static KeyFrameId AddDependent(Map* map, const Eigen::Vector3d& off, double turn_deg) {
    const Rigid3 truth = CameraAt(kPanoramaCenter + off, {0, turn_deg, 0});
    return map->AddKeyFrame(testing_world::MakeDependent(*world_, camera_, truth, panorama_, kPanoramaCenter))
        .keyframe.id;
  }
  // Reduces the finite points to those for which `keep` is true.
  template <typename Keep>
  static void KeepPoints(Map* map, Keep keep) {
    std::vector<MapPointId> gone;
    for (const Map::PointRecord& record : map->points()) {
      if (record.alive && !record.point.infinite() && !keep(record.point)) gone.push_back(record.point.id);
    }
    for (const MapPointId id : gone) map->RemovePoint(id);
  }
  // The finite points that a camera truly sees.
  static int Visible(Map* map, const Rigid3& pose) {
    int visible = 0;
    for (const Map::PointRecord& record : map->points())
      visible +=
          record.alive && !record.point.infinite() && world_->Sees(*camera_, pose, record.point.position());
    return visible;
  }

  static RenderedWorld* world_;
  static std::shared_ptr<const CameraModel> camera_;
  static std::shared_ptr<const MapSnapshot> true_map_;
  static KeyFrameId reference_;
  static PanoramaId panorama_;
};
RenderedWorld* PanoramaMappingTest::world_ = nullptr;
std::shared_ptr<const CameraModel> PanoramaMappingTest::camera_;
std::shared_ptr<const MapSnapshot> PanoramaMappingTest::true_map_;
KeyFrameId PanoramaMappingTest::reference_ = kNoId;
PanoramaId PanoramaMappingTest::panorama_ = kNoId;

TEST_F(PanoramaMappingTest, AddsInfinitePointsForCorners) {
  Map map = MapWithPanorama();
  const std::size_t before = map.AlivePoints();
  const int added = AddInfinitePoints({}, reference_, {}, &map);
  EXPECT_GT(added, 100);
  EXPECT_EQ(map.AlivePoints(), before + static_cast<std::size_t>(added));
  const auto snapshot = map.Snapshot();
  EXPECT_EQ(Validate(*snapshot), "");
  std::array<int, kPyramidLevels> by_level{};
  const KeyFrame* keyframe = snapshot->FindKeyFrame(reference_);
  for (const Observation& observation : snapshot->observations) {
    const MapPoint* point = snapshot->FindPoint(observation.point);
    if (!point->infinite()) continue;
    ++by_level[observation.level];
    EXPECT_EQ(point->panorama, panorama_);
    EXPECT_EQ(point->source_keyframe, reference_);
    EXPECT_NEAR(point->position().norm(), 1, 1e-12);
    const auto pixel = camera_->Project(keyframe->camera_from_map.rotation * point->position());
    ASSERT_TRUE(pixel);
    EXPECT_LT((*pixel - observation.pixel.cast<double>()).norm(), 1e-3);
    const Eigen::Vector2d source = LevelZeroFromLevel(point->source_pixel.cast<double>(), observation.level);
    EXPECT_LT((source - observation.pixel.cast<double>()).norm(), 1e-3);
  }
  for (std::size_t level = 0; level < kPyramidLevels; ++level)
    EXPECT_LE(by_level[level], InfinitePointOptions().max_points[level]);
}

TEST_F(PanoramaMappingTest, AddsNoneNearKnownFeatures) {
  Map map = MapWithPanorama();
  std::vector<Eigen::Vector2f> known, taken;
  Random random(5);
  for (int i = 0; i < 120; ++i) {
    const Eigen::Vector2f pixel(static_cast<float>(random.Uniform(20, 460)),
                                static_cast<float>(random.Uniform(20, 340)));
    if (i % 2 == 0) {
      taken.push_back(pixel);
      continue;
    }
    MapPoint point;
    point.point_in_map = {0, 0, 2, 1};
    point.source_keyframe = reference_;
    known.push_back(pixel);
    map.AddObservation({reference_, map.AddPoint(point), pixel, 0});
  }
  EXPECT_GT(AddInfinitePoints({}, reference_, taken, &map), 20);
  for (const Observation& observation : map.FindKeyFrame(reference_)->observations) {
    if (!map.FindPoint(observation.point)->point.infinite()) continue;
    const auto cell_of = [&](const Eigen::Vector2f& pixel) -> Eigen::Vector2d {
      return (LevelFromLevelZero(pixel.cast<double>(), observation.level) /
              InfinitePointOptions().min_distance_px)
          .array()
          .floor();
    };
    const auto same_cell = [&](const Eigen::Vector2f& other) {
      return cell_of(other) == cell_of(observation.pixel);
    };
    EXPECT_TRUE(std::none_of(taken.begin(), taken.end(), same_cell));
    // Pixels that were measured on level 0 occupy no cell on the coarse levels.
    if (observation.level <= 1) {
      EXPECT_TRUE(std::none_of(known.begin(), known.end(), same_cell));
    }
  }
  // Repeats until every unmatched corner is used.
  int rounds = 0;
  while (rounds < 12 && AddInfinitePoints({}, reference_, taken, &map) > 0) ++rounds;
  EXPECT_LT(rounds, 12);
}

TEST_F(PanoramaMappingTest, AddsNoneOutsideAPanorama) {
  Map map = MapWithPanorama();
  EXPECT_EQ(AddInfinitePoints({}, 0, {}, &map), 0);
  EXPECT_EQ(AddInfinitePoints({}, 999, {}, &map), 0);
}

TEST_F(PanoramaMappingTest, LocalizesAKeyframeThatSeesFinitePoints) {
  for (const Eigen::Vector3d& off :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.06, 0.02, -0.03), Eigen::Vector3d(-0.05, 0, 0.06)}) {
    Map map = MapWithPanorama();
    PointSearcher searcher;
    AddInfinitePoints({}, reference_, {}, &map);
    const KeyFrameId id = AddDependent(&map, off, 15);
    const Rigid3 truth = CameraAt(kPanoramaCenter + off, {0, 15, 0});
    const int rays = AddInfinitePoints({}, id, {}, &map);
    ASSERT_TRUE(LocalizePanoramaKeyFrame({}, id, 1, &map, &searcher));
    const Map::KeyFrameRecord& record = *map.FindKeyFrame(id);
    EXPECT_LT((record.keyframe.camera_from_map.OriginInSource() - truth.OriginInSource()).norm(), 0.006);
    EXPECT_LT(RotationErrorDeg(record.keyframe.camera_from_map, truth), 0.1);
    EXPECT_EQ(record.keyframe.kind, KeyFrameKind::kSixDof);
    // It is the reference of its own panorama map, which contains its own infinite points, except those that
    // coincided with finite points.
    EXPECT_NE(record.keyframe.panorama, panorama_);
    int finite = 0, infinite = 0;
    for (const Observation& observation : record.observations) {
      const MapPoint& point = map.FindPoint(observation.point)->point;
      (point.infinite() ? infinite : finite) += 1;
      if (point.infinite()) {
        EXPECT_EQ(point.panorama, record.keyframe.panorama);
        continue;
      }
      const auto pixel = camera_->Project(truth * point.position());
      ASSERT_TRUE(pixel);
      EXPECT_LT((*pixel - observation.pixel.cast<double>()).norm(), 3.0 * (1 << observation.level));
    }
    EXPECT_GE(finite, LocalizationOptions().min_inliers);
    EXPECT_GT(infinite, 0);
    EXPECT_LT(infinite, rays);
    EXPECT_GT(record.keyframe.mean_depth, 1.0);
    EXPECT_LT(record.keyframe.mean_depth, 3.2);
    EXPECT_EQ(Validate(*map.Snapshot()), "");
    EXPECT_FALSE(LocalizePanoramaKeyFrame({}, id, 1, &map, &searcher)) << "it is localized already";
  }
}

TEST_F(PanoramaMappingTest, RejectsAPoseFromTooFewPoints) {
  Map map = MapWithPanorama();
  PointSearcher searcher;
  const KeyFrameId id = AddDependent(&map, {0.04, 0, 0}, 15);
  const Rigid3 truth = CameraAt(kPanoramaCenter + Eigen::Vector3d(0.04, 0, 0), {0, 15, 0});
  int kept = 0;
  KeepPoints(&map, [&](const MapPoint& point) {
    return world_->Sees(*camera_, truth, point.position()) && ++kept <= 39;
  });
  ASSERT_EQ(Visible(&map, truth), 39);
  const auto before = map.Snapshot();
  EXPECT_FALSE(LocalizePanoramaKeyFrame({}, id, 1, &map, &searcher));
  ExpectSameMap(*before, *map.Snapshot());
}

TEST_F(PanoramaMappingTest, RejectsAPoseFromPointsInOneCornerOfTheImage) {
  Map map = MapWithPanorama();
  PointSearcher searcher;
  const KeyFrameId id = AddDependent(&map, {0.04, 0, 0}, 15);
  const Rigid3 truth = CameraAt(kPanoramaCenter + Eigen::Vector3d(0.04, 0, 0), {0, 15, 0});
  KeepPoints(&map, [&](const MapPoint& point) {
    const auto pixel = camera_->Project(truth * point.position());
    return pixel && pixel->x() < 230 && pixel->y() < 170;
  });
  ASSERT_GE(Visible(&map, truth), LocalizationOptions().min_inliers);
  const auto before = map.Snapshot();
  EXPECT_FALSE(LocalizePanoramaKeyFrame({}, id, 1, &map, &searcher));
  ExpectSameMap(*before, *map.Snapshot());
}

TEST_F(PanoramaMappingTest, DoesNotLocalizeAnImageOfAnotherPlace) {
  const RenderedWorld other = testing_world::Chamber(8181);
  Map map = MapWithPanorama();
  PointSearcher searcher;
  const KeyFrameId id =
      map.AddKeyFrame(testing_world::MakeDependent(other, camera_, CameraAt(kPanoramaCenter, {0, 15, 0}),
                                                   panorama_, kPanoramaCenter))
          .keyframe.id;
  const auto before = map.Snapshot();
  EXPECT_FALSE(LocalizePanoramaKeyFrame({}, id, 1, &map, &searcher));
  ExpectSameMap(*before, *map.Snapshot());
}

TEST_F(PanoramaMappingTest, LocalizesOnlyExistingDependentKeyframes) {
  Map map = MapWithPanorama();
  PointSearcher searcher;
  const auto before = map.Snapshot();
  EXPECT_FALSE(LocalizePanoramaKeyFrame({}, 0, 1, &map, &searcher));
  EXPECT_FALSE(LocalizePanoramaKeyFrame({}, reference_, 1, &map, &searcher));
  EXPECT_FALSE(LocalizePanoramaKeyFrame({}, 999, 1, &map, &searcher));
  ExpectSameMap(*before, *map.Snapshot());
}

TEST(DuplicateInfinitePoints, AreRemovedIfAFinitePointIsObservedAtTheSamePixel) {
  Map map;
  const KeyFrameId id = map.AddKeyFrame(BlankKeyFrame()).keyframe.id;
  const PanoramaId panorama = map.OpenPanorama(id);
  const auto add = [&](bool infinite, const Eigen::Vector2f& pixel, std::uint8_t level) {
    MapPoint point;
    point.point_in_map = infinite ? Eigen::Vector4d(0, 0, 1, 0) : Eigen::Vector4d(0, 0, 2, 1);
    if (infinite) point.panorama = panorama;
    point.source_keyframe = id;
    const MapPointId added = map.AddPoint(point);
    map.AddObservation({id, added, pixel, level});
    return added;
  };
  const MapPointId finite = add(false, {30, 30}, 0);
  const MapPointId duplicate = add(true, {31.9f, 30}, 0), apart = add(true, {32.1f, 30}, 0);
  const MapPointId coarse_duplicate = add(true, {30, 37.9f}, 2), coarse_apart = add(true, {30, 38.1f}, 2);
  EXPECT_EQ(RemoveDuplicateInfinitePoints(id, &map), 2);
  for (const MapPointId gone : {duplicate, coarse_duplicate}) EXPECT_EQ(map.FindPoint(gone), nullptr) << gone;
  for (const MapPointId kept : {finite, apart, coarse_apart}) EXPECT_NE(map.FindPoint(kept), nullptr) << kept;
  EXPECT_EQ(RemoveDuplicateInfinitePoints(id, &map), 0);
  EXPECT_EQ(RemoveDuplicateInfinitePoints(77, &map), 0);
  EXPECT_EQ(Validate(*map.Snapshot()), "");
}

}  // namespace
}  // namespace docent::engine

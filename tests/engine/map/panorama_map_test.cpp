// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <vector>

#include "engine/map/map.h"
#include "tests/engine/geometry/test_math.h"
#include "tests/engine/mapping/panorama/panorama_scene.h"

// Tests of the panorama maps within a Map.
namespace docent::engine {
namespace {

using testing_world::BlankKeyFrame;
using testing_world::CameraAt;

// Keyframe 0 is the reference of panorama map 0. Keyframes 1 and 2 are its dependent keyframes, rotated by 10
// and 20 degrees. Keyframe 3 is an ordinary keyframe.
class PanoramaMaps : public ::testing::Test {
 protected:
  PanoramaMaps() {
    map_.AddKeyFrame(BlankKeyFrame());
    map_.OpenPanorama(0);
    for (const double turn : {10.0, 20.0}) {
      KeyFrame dependent = BlankKeyFrame(CameraAt({0, 0, 0}, {0, turn, 0}));
      dependent.kind = KeyFrameKind::kPanorama;
      dependent.panorama = 0;
      map_.AddKeyFrame(dependent);
    }
    map_.AddKeyFrame(BlankKeyFrame(CameraAt({0.5, 0, 0})));
  }
  // Adds an infinite point straight ahead of the map's origin.
  MapPointId AddInfinite(KeyFrameId source, const std::vector<KeyFrameId>& others = {}) {
    MapPoint point;
    point.point_in_map = {0, 0, 1, 0};
    point.panorama = map_.FindKeyFrame(source)->keyframe.panorama;
    point.source_keyframe = source;
    const MapPointId id = map_.AddPoint(point);
    Observe(source, id);
    for (const KeyFrameId other : others) Observe(other, id);
    return id;
  }
  MapPointId AddFinite(KeyFrameId source, KeyFrameId other) {
    MapPoint point;
    point.point_in_map = {0, 0, 2, 1};
    point.source_keyframe = source;
    const MapPointId id = map_.AddPoint(point);
    Observe(source, id);
    Observe(other, id);
    return id;
  }
  // Adds an observation where the point truly projects.
  void Observe(KeyFrameId keyframe, MapPointId id) {
    const KeyFrame& seeing = map_.FindKeyFrame(keyframe)->keyframe;
    const Eigen::Vector4d& x = map_.FindPoint(id)->point.point_in_map;
    const Eigen::Vector3d in_camera = seeing.camera_from_map.rotation * Eigen::Vector3d(x.head<3>()) +
                                      x[3] * seeing.camera_from_map.translation;
    ASSERT_TRUE(map_.AddObservation({keyframe, id, seeing.camera->Project(in_camera)->cast<float>(), 0}));
  }
  std::vector<KeyFrameId> Observers(MapPointId id) {
    const Map::PointRecord* record = map_.FindPoint(id);
    return record ? record->observers : std::vector<KeyFrameId>();
  }
  // Points and keyframes list the same observations, and each infinite point is observed from its own
  // panorama map
  // only.
  void ExpectConsistent() {
    EXPECT_EQ(Validate(*map_.Snapshot()), "");
    std::size_t from_keyframes = 0, from_points = 0;
    for (const auto& [id, record] : map_.keyframes()) {
      from_keyframes += record.observations.size();
      for (const Observation& observation : record.observations) {
        const Map::PointRecord* point = map_.FindPoint(observation.point);
        ASSERT_NE(point, nullptr);
        EXPECT_TRUE(std::binary_search(point->observers.begin(), point->observers.end(), id));
        if (point->point.infinite()) {
          EXPECT_EQ(point->point.panorama, record.keyframe.panorama);
        } else {
          EXPECT_EQ(record.keyframe.kind, KeyFrameKind::kSixDof);
        }
      }
    }
    for (const Map::PointRecord& record : map_.points())
      if (record.alive) from_points += record.observers.size();
    EXPECT_EQ(from_keyframes, from_points);
  }

  Map map_;
};

using KeyFrameIds = std::vector<KeyFrameId>;

TEST_F(PanoramaMaps, OpenAtAnOrdinaryKeyframeThatKeepsItsObservations) {
  const MapPointId finite = AddFinite(3, 0);
  const PanoramaId id = map_.OpenPanorama(3);
  EXPECT_NE(id, 0u);
  ASSERT_EQ(map_.panoramas().size(), 2u);
  EXPECT_EQ(map_.panoramas()[1].reference, 3u);
  EXPECT_EQ(map_.FindKeyFrame(3)->keyframe.panorama, id);
  EXPECT_EQ(map_.FindKeyFrame(3)->keyframe.kind, KeyFrameKind::kSixDof);
  EXPECT_EQ(Observers(finite), (KeyFrameIds{0, 3}));
  ExpectConsistent();
}

TEST_F(PanoramaMaps, TakeOverTheInfinitePointsOfTheirNewReference) {
  const MapPointId own = AddInfinite(1), shared = AddInfinite(1, {0, 2}),
                   of_reference = AddInfinite(0, {1, 2});
  const MapPointId untouched = AddInfinite(2), seen_by_it_alone = AddInfinite(2, {1});
  // Its corrected pose is rotated by 5 further degrees.
  map_.FindKeyFrame(1)->keyframe.camera_from_map = CameraAt({0.1, 0, 0}, {0, 15, 0});
  const PanoramaId id = map_.OpenPanorama(1);
  EXPECT_EQ(map_.FindKeyFrame(1)->keyframe.kind, KeyFrameKind::kSixDof);
  for (const MapPointId moved : {own, shared}) {
    EXPECT_EQ(map_.FindPoint(moved)->point.panorama, id);
    EXPECT_EQ(Observers(moved), KeyFrameIds{1});
    const double five = Radians(5);
    EXPECT_LT(
        (map_.FindPoint(moved)->point.position() - Eigen::Vector3d(std::sin(five), 0, std::cos(five))).norm(),
        1e-6);
  }
  EXPECT_EQ(Observers(of_reference), (KeyFrameIds{0, 2}));
  EXPECT_EQ(Observers(untouched), KeyFrameIds{2});
  EXPECT_EQ(Observers(seen_by_it_alone), KeyFrameIds{2});
  EXPECT_EQ(map_.FindPoint(of_reference)->point.panorama, 0u);
  ExpectConsistent();
}

TEST_F(PanoramaMaps, NeverReuseIds) {
  const PanoramaId first = map_.OpenPanorama(3);
  map_.RemoveKeyFrame(3);
  EXPECT_EQ(map_.panoramas().size(), 1u);
  map_ = Map(*map_.Snapshot());
  const KeyFrameId other = map_.AddKeyFrame(BlankKeyFrame()).keyframe.id;
  EXPECT_GT(map_.OpenPanorama(other), first);
}

TEST_F(PanoramaMaps, CanChangeTheirReference) {
  const MapPointId of_old = AddInfinite(0, {1}), of_new = AddInfinite(1);
  map_.SetReference(0, 1);
  ASSERT_EQ(map_.panoramas().size(), 1u);
  EXPECT_EQ(map_.panoramas()[0].reference, 1u);
  EXPECT_EQ(map_.FindKeyFrame(0)->keyframe.kind, KeyFrameKind::kPanorama);
  EXPECT_EQ(map_.FindKeyFrame(1)->keyframe.kind, KeyFrameKind::kSixDof);
  EXPECT_EQ(Observers(of_old), (KeyFrameIds{0, 1}));
  EXPECT_EQ(Observers(of_new), KeyFrameIds{1});
  ExpectConsistent();
  map_.SetReference(0, 1);
  EXPECT_EQ(map_.FindKeyFrame(1)->keyframe.kind, KeyFrameKind::kSixDof)
      << "setting the same reference again changes nothing";
  map_.SetReference(9, 3);
  EXPECT_EQ(map_.panoramas()[0].reference, 1u) << "an unknown panorama map is ignored";
}

TEST_F(PanoramaMaps, AreRemovedWithTheirReference) {
  const MapPointId infinite = AddInfinite(1, {0}), finite = AddFinite(3, 0), other = AddFinite(3, 0);
  map_.OpenPanorama(3);
  const MapPointId elsewhere = AddInfinite(3);
  map_.RemoveKeyFrame(0);
  ASSERT_EQ(map_.panoramas().size(), 1u);
  EXPECT_EQ(map_.panoramas()[0].reference, 3u);
  EXPECT_EQ(map_.keyframes().size(), 1u);
  EXPECT_EQ(map_.FindPoint(infinite), nullptr);
  EXPECT_EQ(map_.FindPoint(finite), nullptr) << "a finite point needs two observations";
  EXPECT_EQ(map_.FindPoint(other), nullptr);
  EXPECT_NE(map_.FindPoint(elsewhere), nullptr);
  ExpectConsistent();
}

TEST_F(PanoramaMaps, LoseOnlyTheOwnInfinitePointsOfARemovedKeyframe) {
  const MapPointId own = AddInfinite(1), shared = AddInfinite(0, {1, 2});
  map_.RemoveKeyFrame(1);
  EXPECT_EQ(map_.panoramas().size(), 1u);
  EXPECT_EQ(map_.FindPoint(own), nullptr);
  EXPECT_EQ(Observers(shared), (KeyFrameIds{0, 2}));
  ExpectConsistent();
}

TEST_F(PanoramaMaps, KeepAnInfinitePointUntilItsLastObservationIsRemoved) {
  const MapPointId shared = AddInfinite(0, {1, 2});
  map_.RemoveObservation(1, shared);
  map_.RemoveObservation(2, shared);
  EXPECT_EQ(Observers(shared), KeyFrameIds{0});
  map_.RemoveObservation(0, shared);
  EXPECT_EQ(map_.FindPoint(shared), nullptr);
  ExpectConsistent();
}

TEST_F(PanoramaMaps, RemoveDependentObservationsOfAPointThatBecomesFinite) {
  const MapPointId id = AddInfinite(0, {1, 2});
  map_.MakeFinite(map_.FindPoint(id), {0, 0, 2});
  const MapPoint& point = map_.FindPoint(id)->point;
  EXPECT_EQ(point.point_in_map, Eigen::Vector4d(0, 0, 2, 1));
  EXPECT_TRUE(point.was_infinite);
  EXPECT_EQ(point.panorama, kNoId);
  EXPECT_EQ(Observers(id), KeyFrameIds{0});
  Observe(3, id);
  EXPECT_EQ(Observers(id), (KeyFrameIds{0, 3}));
  ExpectConsistent();
}

TEST_F(PanoramaMaps, UpdateDirectionsToTheMeanRay) {
  const MapPointId id = AddInfinite(0, {1, 2});
  map_.FindPoint(id)->point.point_in_map = {0.6, 0, 0.8, 0};
  map_.UpdateDirection(map_.FindPoint(id));
  EXPECT_LT((map_.FindPoint(id)->point.position() - Eigen::Vector3d::UnitZ()).norm(), 1e-6);
  EXPECT_LT((map_.FindPoint(id)->point.normal + Eigen::Vector3f::UnitZ()).norm(), 1e-6f);
}

TEST_F(PanoramaMaps, AreRestoredFromTheirSnapshot) {
  AddInfinite(0, {1, 2});
  AddFinite(3, 0);
  map_.OpenPanorama(3);
  AddInfinite(3);
  const auto before = map_.Snapshot();
  map_ = Map(*before);
  ExpectConsistent();
  const auto after = map_.Snapshot();
  ASSERT_EQ(after->panoramas.size(), before->panoramas.size());
  for (std::size_t i = 0; i < before->panoramas.size(); ++i) {
    EXPECT_EQ(after->panoramas[i].id, before->panoramas[i].id);
    EXPECT_EQ(after->panoramas[i].reference, before->panoramas[i].reference);
  }
  EXPECT_EQ(after->next_panorama, before->next_panorama);
  for (std::size_t i = 0; i < before->keyframes.size(); ++i) {
    EXPECT_EQ(after->keyframes[i].kind, before->keyframes[i].kind);
    EXPECT_EQ(after->keyframes[i].panorama, before->keyframes[i].panorama);
  }
  for (std::size_t i = 0; i < before->points.size(); ++i)
    EXPECT_EQ(after->points[i].panorama, before->points[i].panorama);
  EXPECT_EQ(after->observations.size(), before->observations.size());
}

TEST(MapOfDirections, HasNoFinitePointsUntilOneIsConverted) {
  Map map;
  map.AddKeyFrame(BlankKeyFrame());
  const PanoramaId panorama = map.OpenPanorama(0);
  EXPECT_FALSE(map.Snapshot()->HasFinitePoints());
  MapPoint point;
  point.point_in_map = {0, 0, 1, 0};
  point.panorama = panorama;
  point.source_keyframe = 0;
  const MapPointId id = map.AddPoint(point);
  map.AddObservation({0, id, {31, 31}, 0});
  EXPECT_FALSE(map.Snapshot()->HasFinitePoints());
  map.MakeFinite(map.FindPoint(id), {0, 0, 2});
  EXPECT_TRUE(map.Snapshot()->HasFinitePoints());
}

}  // namespace
}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#include "engine/map/map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "engine/base/random.h"
#include "tests/engine/mapping/panorama/panorama_scene.h"

namespace docent::engine {
namespace {

using testing_world::BlankKeyFrame;
using testing_world::CameraAt;

MapPoint PointFrom(KeyFrameId source) {
  MapPoint point;
  point.point_in_map = {0.1, 0.2, 2, 1};
  point.source_keyframe = source;
  point.source_pixel = {20, 20};
  return point;
}

Observation MakeObservation(KeyFrameId keyframe, MapPointId point) {
  return {keyframe, point, Eigen::Vector2f(10, 12), 1};
}

// Checks every invariant that map.h states.
void ExpectConsistent(const Map& map) {
  std::set<std::pair<KeyFrameId, MapPointId>> from_keyframes, from_points;
  for (const auto& [id, record] : map.keyframes()) {
    EXPECT_EQ(id, record.keyframe.id);
    EXPECT_TRUE(std::is_sorted(record.observations.begin(), record.observations.end(),
                               [](const auto& a, const auto& b) { return a.point < b.point; }));
    for (const Observation& observation : record.observations) {
      EXPECT_EQ(observation.keyframe, id);
      EXPECT_TRUE(from_keyframes.emplace(id, observation.point).second) << "observed twice";
    }
  }
  std::size_t alive = 0;
  for (const Map::PointRecord& record : map.points()) {
    if (!record.alive) {
      EXPECT_TRUE(record.observers.empty());
      continue;
    }
    ++alive;
    EXPECT_TRUE(map.keyframes().contains(record.point.source_keyframe)) << "the source keyframe is missing";
    EXPECT_TRUE(std::is_sorted(record.observers.begin(), record.observers.end()));
    for (const KeyFrameId observer : record.observers) from_points.emplace(observer, record.point.id);
  }
  EXPECT_EQ(from_keyframes, from_points);
  EXPECT_EQ(alive, map.AlivePoints());
}

// Adds a point with its two observations.
MapPointId AddObservedPoint(Map* map, KeyFrameId source, KeyFrameId other) {
  const MapPointId id = map->AddPoint(PointFrom(source));
  map->AddObservation(MakeObservation(source, id));
  map->AddObservation(MakeObservation(other, id));
  return id;
}

class RandomMap {
 public:
  explicit RandomMap(std::uint64_t seed) : random_(seed) {
    for (int i = 0; i < 3; ++i) AddKeyFrame();
  }

  void Change(Map* map) {
    std::vector<KeyFrameId> keyframes;
    for (const auto& [id, record] : map->keyframes()) keyframes.push_back(id);
    const std::uint32_t action = random_.Below(100);
    if (keyframes.size() < 3 || action < 4) {
      NoteKeyFrame(map->AddKeyFrame(BlankKeyFrame()).keyframe.id);
      return;
    }
    const KeyFrameId one = keyframes[random_.Below(static_cast<std::uint32_t>(keyframes.size()))];
    const KeyFrameId other = keyframes[random_.Below(static_cast<std::uint32_t>(keyframes.size()))];
    const MapPointId point =
        map->points().empty()
            ? 0
            : map->points()[random_.Below(static_cast<std::uint32_t>(map->points().size()))].point.id;
    if (action < 40) {
      if (one != other) {
        EXPECT_TRUE(points_.insert(AddObservedPoint(map, one, other)).second) << "id given twice";
      }
    } else if (action < 70) {
      map->AddObservation(MakeObservation(one, point));
    } else if (action < 85) {
      map->RemoveObservation(one, point);
    } else if (action < 93) {
      map->RemovePoint(point);
    } else if (action < 96) {
      map->RemoveKeyFrame(one);
    } else {
      map->Snapshot();
    }
  }

  Map& map() { return map_; }

 private:
  void AddKeyFrame() { NoteKeyFrame(map_.AddKeyFrame(BlankKeyFrame()).keyframe.id); }
  void NoteKeyFrame(KeyFrameId id) { EXPECT_TRUE(keyframes_.insert(id).second) << "id given twice"; }

  Random random_;
  Map map_;
  std::set<KeyFrameId> keyframes_;
  std::set<MapPointId> points_;
};

TEST(Map, StaysConsistentUnderAnySequenceOfChanges) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    RandomMap world(seed);
    for (int step = 0; step < 400; ++step) {
      world.Change(&world.map());
      if (step % 10 == 0) ExpectConsistent(world.map());
    }
    ExpectConsistent(world.map());
    const auto snapshot = world.map().Snapshot();
    EXPECT_EQ(Validate(*snapshot), "");
    EXPECT_EQ(snapshot->points.size(), world.map().AlivePoints());
    EXPECT_GT(snapshot->points.size(), 3u);
  }
}

TEST(Map, NeverReusesIdsEvenAfterBeingStored) {
  for (std::uint64_t seed = 20; seed < 23; ++seed) {
    RandomMap world(seed);
    for (int round = 0; round < 10; ++round) {
      for (int step = 0; step < 60; ++step) world.Change(&world.map());
      // The newest ids are removed before the map is stored.
      const auto last = world.map().AddPoint(PointFrom(world.map().keyframes().begin()->first));
      world.map().RemovePoint(last);
      const auto newest = world.map().AddKeyFrame(BlankKeyFrame()).keyframe.id;
      world.map().RemoveKeyFrame(newest);
      world.map() = Map(*world.map().Snapshot());
      EXPECT_GT(world.map().AddKeyFrame(BlankKeyFrame()).keyframe.id, newest);
      const auto next = world.map().AddPoint(PointFrom(world.map().keyframes().begin()->first));
      EXPECT_GT(next, last);
      world.map().RemovePoint(next);
    }
  }
}

TEST(Map, IsRestoredUnchangedFromItsSnapshot) {
  RandomMap world(5);
  for (int step = 0; step < 500; ++step) world.Change(&world.map());
  const auto first = world.map().Snapshot();
  Map copy(*first);
  ExpectConsistent(copy);
  const auto second = copy.Snapshot();
  EXPECT_GT(second->revision, first->revision);
  EXPECT_EQ(second->next_keyframe, first->next_keyframe);
  EXPECT_EQ(second->next_point, first->next_point);
  ASSERT_EQ(second->keyframes.size(), first->keyframes.size());
  ASSERT_EQ(second->points.size(), first->points.size());
  ASSERT_EQ(second->observations.size(), first->observations.size());
  for (std::size_t i = 0; i < first->keyframes.size(); ++i) {
    EXPECT_EQ(second->keyframes[i].id, first->keyframes[i].id);
    EXPECT_EQ(second->keyframes[i].features, first->keyframes[i].features);
  }
  for (std::size_t i = 0; i < first->points.size(); ++i) {
    EXPECT_EQ(second->points[i].id, first->points[i].id);
    EXPECT_EQ(second->points[i].point_in_map, first->points[i].point_in_map);
  }
  for (std::size_t i = 0; i < first->observations.size(); ++i) {
    EXPECT_EQ(second->observations[i].keyframe, first->observations[i].keyframe);
    EXPECT_EQ(second->observations[i].point, first->observations[i].point);
    EXPECT_EQ(second->observations[i].pixel, first->observations[i].pixel);
  }
}

TEST(Map, SnapshotIsNotAffectedByLaterChanges) {
  Map map;
  const auto a = map.AddKeyFrame(BlankKeyFrame()).keyframe.id,
             b = map.AddKeyFrame(BlankKeyFrame()).keyframe.id;
  const auto point = AddObservedPoint(&map, a, b);
  const auto snapshot = map.Snapshot();
  map.FindPoint(point)->point.point_in_map.x() = 5;
  map.RemovePoint(point);
  map.RemoveKeyFrame(b);
  ASSERT_NE(snapshot->FindPoint(point), nullptr);
  EXPECT_EQ(snapshot->FindPoint(point)->point_in_map.x(), 0.1);
  EXPECT_EQ(snapshot->keyframes.size(), 2u);
  EXPECT_EQ(map.Snapshot()->FindPoint(point), nullptr);
}

TEST(Map, RemovesAPointWithoutEnoughObservationsOrWithoutItsSource) {
  Map map;
  std::vector<KeyFrameId> keyframes;
  for (int i = 0; i < 4; ++i) keyframes.push_back(map.AddKeyFrame(BlankKeyFrame()).keyframe.id);
  const auto few = AddObservedPoint(&map, keyframes[0], keyframes[1]);
  map.RemoveObservation(keyframes[1], few);
  EXPECT_EQ(map.FindPoint(few), nullptr);

  const auto many = AddObservedPoint(&map, keyframes[0], keyframes[1]);
  map.AddObservation(MakeObservation(keyframes[2], many));
  map.RemoveObservation(keyframes[1], many);
  ASSERT_NE(map.FindPoint(many), nullptr);
  map.AddObservation(MakeObservation(keyframes[3], many));
  map.RemoveObservation(keyframes[0], many);
  EXPECT_EQ(map.FindPoint(many), nullptr);
  ExpectConsistent(map);
}

TEST(Map, RemovesPointsWithTheirSourceKeyframe) {
  Map map;
  std::vector<KeyFrameId> keyframes;
  for (int i = 0; i < 4; ++i) keyframes.push_back(map.AddKeyFrame(BlankKeyFrame()).keyframe.id);
  // A stored map may hold a point that its own source does not observe.
  const MapPointId point = map.AddPoint(PointFrom(keyframes[0]));
  for (int i = 1; i < 4; ++i)
    map.AddObservation(MakeObservation(keyframes[static_cast<std::size_t>(i)], point));
  map.RemoveKeyFrame(keyframes[0]);
  ExpectConsistent(map);
  EXPECT_EQ(Validate(*map.Snapshot()), "");
}

TEST(Map, RejectsDuplicateObservationsAndUnknownIds) {
  Map map;
  const auto a = map.AddKeyFrame(BlankKeyFrame()).keyframe.id,
             b = map.AddKeyFrame(BlankKeyFrame()).keyframe.id;
  const auto point = AddObservedPoint(&map, a, b);
  EXPECT_FALSE(map.AddObservation(MakeObservation(a, point)));
  EXPECT_FALSE(map.AddObservation(MakeObservation(99, point)));
  EXPECT_FALSE(map.AddObservation(MakeObservation(a, 99)));
  map.RemovePoint(point);
  EXPECT_FALSE(map.AddObservation(MakeObservation(a, point)));
  map.RemovePoint(point);
  map.RemovePoint(77);
  map.RemoveObservation(a, point);
  map.RemoveKeyFrame(55);
  EXPECT_EQ(map.AlivePoints(), 0u);
  ExpectConsistent(map);
}

TEST(Map, ListsCovisibleKeyframesMostSharedPointsFirst) {
  Map map;
  std::vector<KeyFrameId> keyframes;
  for (int i = 0; i < 4; ++i) keyframes.push_back(map.AddKeyFrame(BlankKeyFrame()).keyframe.id);
  for (int i = 0; i < 5; ++i) AddObservedPoint(&map, keyframes[0], keyframes[2]);
  for (int i = 0; i < 3; ++i) AddObservedPoint(&map, keyframes[1], keyframes[0]);
  AddObservedPoint(&map, keyframes[1], keyframes[3]);
  using Shared = std::vector<std::pair<KeyFrameId, int>>;
  EXPECT_EQ(map.Covisible(keyframes[0]), (Shared{{keyframes[2], 5}, {keyframes[1], 3}}));
  EXPECT_EQ(map.Covisible(keyframes[3]), (Shared{{keyframes[1], 1}}));
  EXPECT_TRUE(map.Covisible(1234).empty());
}

TEST(Map, DepthIsTheMedianOfFinitePointsInFront) {
  Map map;
  const auto a = map.AddKeyFrame(BlankKeyFrame(CameraAt({0, 0, -1}))).keyframe.id;
  const auto b = map.AddKeyFrame(BlankKeyFrame()).keyframe.id;
  for (const double z : {1.0, 1.5, 2.0, 2.5, 50.0, -40.0}) {
    const auto id = AddObservedPoint(&map, a, b);
    map.FindPoint(id)->point.point_in_map = {0, 0, z, 1};
  }
  const auto infinite = AddObservedPoint(&map, a, b);
  map.FindPoint(infinite)->point.point_in_map = {0, 0, 1, 0};
  map.UpdateDepth(map.FindKeyFrame(a));
  EXPECT_DOUBLE_EQ(map.FindKeyFrame(a)->keyframe.mean_depth, 3.0);
  // Distances from the median: 1, 0.5, 0, 0.5, 48.
  EXPECT_NEAR(map.FindKeyFrame(a)->keyframe.depth_sigma, 1.4826 * 0.5, 1e-9);
}

TEST(Map, NormalsPointTowardsTheObservers) {
  Map map;
  const auto a = map.AddKeyFrame(BlankKeyFrame(CameraAt({-1, 0, 0}))).keyframe.id;
  const auto b = map.AddKeyFrame(BlankKeyFrame(CameraAt({1, 0, 0}))).keyframe.id;
  const auto id = AddObservedPoint(&map, a, b);
  map.FindPoint(id)->point.point_in_map = {0, 0, 2, 1};
  map.UpdateNormal(map.FindPoint(id));
  EXPECT_LT((map.FindPoint(id)->point.normal - Eigen::Vector3f(0, 0, -1)).norm(), 1e-6f);
  map.FindPoint(id)->point.point_in_map = {1, 0, 0, 0};
  map.UpdateNormal(map.FindPoint(id));
  EXPECT_LT((map.FindPoint(id)->point.normal - Eigen::Vector3f(-1, 0, 0)).norm(), 1e-6f);
}

TEST(Map, FusePointsMergesObservationsAndCounts) {
  Map map;
  for (int i = 0; i < 4; ++i) map.AddKeyFrame(BlankKeyFrame());
  const MapPointId known = AddObservedPoint(&map, 0, 1), duplicate = AddObservedPoint(&map, 2, 1);
  map.AddObservation(MakeObservation(3, duplicate));
  map.FindPoint(known)->seen_inlier = 3;
  map.FindPoint(duplicate)->seen_inlier = 4;
  map.FusePoints(known, duplicate);
  ExpectConsistent(map);
  EXPECT_EQ(map.FindPoint(duplicate), nullptr);
  EXPECT_EQ(map.FindPoint(known)->observers, (std::vector<KeyFrameId>{0, 1, 2, 3}));
  EXPECT_EQ(map.FindPoint(known)->seen_inlier, 7);
  map.FusePoints(known, known);
  map.FusePoints(known, duplicate);
  EXPECT_EQ(map.AlivePoints(), 1u) << "a point is not fused with itself or with a removed point";
}

TEST(Map, CorrectMovesTheNeighbourhoodOfAKeyFrame) {
  Map map;
  for (int i = 0; i < 4; ++i) {
    KeyFrame keyframe = BlankKeyFrame();
    keyframe.camera_from_map = CameraAt({0.3 * i, 0, 0}, {0, 5.0 * i, 0});
    keyframe.mean_depth = 2;
    map.AddKeyFrame(keyframe);
  }
  const MapPointId unmoved = AddObservedPoint(&map, 0, 1), moved_point = AddObservedPoint(&map, 2, 1);
  const PanoramaId panorama = map.OpenPanorama(2);
  KeyFrame& dependent = map.FindKeyFrame(3)->keyframe;
  dependent.kind = KeyFrameKind::kPanorama;
  dependent.panorama = panorama;
  const Map before = map;
  const auto in_camera = [](Map of, KeyFrameId keyframe, MapPointId point) {
    return Eigen::Vector3d(of.FindKeyFrame(keyframe)->keyframe.camera_from_map *
                           of.FindPoint(point)->point.position());
  };
  Sim3 moved;
  moved.rotation = Rotation3::Exp({0.1, 0.2, -0.3});
  moved.translation = {1, 2, 3};
  moved.scale = 1.25;
  map.Correct({{2, moved}});
  ExpectConsistent(map);
  // In the camera frame everything is scaled, so that every point still projects to the same pixel.
  EXPECT_LT((in_camera(map, 2, moved_point) - 1.25 * in_camera(before, 2, moved_point)).norm(), 1e-12);
  EXPECT_LT((in_camera(map, 3, moved_point) - 1.25 * in_camera(before, 3, moved_point)).norm(), 1e-12)
      << "a dependent keyframe moves with its reference";
  EXPECT_DOUBLE_EQ(map.FindKeyFrame(2)->keyframe.mean_depth, 2.5);
  EXPECT_LT((in_camera(map, 0, unmoved) - in_camera(before, 0, unmoved)).norm(), 1e-15);
  const auto snapshot = map.Snapshot();
  ASSERT_EQ(snapshot->corrections.size(), 1u);
  EXPECT_EQ(snapshot->corrections[0]->revision, snapshot->revision);
  EXPECT_EQ(snapshot->corrections[0]->after_from_before.size(), 4u);
  EXPECT_EQ(Map(*snapshot).Snapshot()->corrections.size(), 1u)
      << "a map made from the snapshot keeps its corrections";
}

}  // namespace
}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle/map_adjustment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <limits>
#include <vector>

#include "engine/base/median.h"
#include "engine/base/random.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine {
namespace {

using testing_world::CameraAt;
using testing_world::RenderedWorld;

const std::vector<Rigid3>& Poses() {
  static const std::vector<Rigid3> poses = {CameraAt({0, 0, 0}), CameraAt({0.25, 0, 0}, {0, -2, 0}),
                                            CameraAt({0.5, 0.1, 0}), CameraAt({0.1, -0.15, 0.2}, {3, 0, 5}),
                                            CameraAt({-0.3, 0, 0}, {0, 5, 0})};
  return poses;
}

// A true map whose first two keyframes are fixed, which fixes the coordinate frame and the scale.
class MapAdjustment : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    Map made =
        testing_world::TrueMap(RenderedWorld::Room(31), testing_world::PinholeCamera(240, 180), Poses(), 80);
    made.FindKeyFrame(1)->keyframe.fixed = true;
    truth_ = made.Snapshot();
  }
  static void TearDownTestSuite() { truth_.reset(); }

  static Map Noisy(double distance_m, double angle_deg, std::uint64_t seed) {
    Map map(*truth_);
    Random random(seed);
    for (auto& [id, record] : map.keyframes()) {
      if (record.keyframe.fixed) continue;
      const auto part = [&](double limit) { return random.Uniform(-limit, limit); };
      record.keyframe.camera_from_map = CameraAt({part(distance_m), part(distance_m), part(distance_m)},
                                                 {part(angle_deg), part(angle_deg), part(angle_deg)}) *
                                        record.keyframe.camera_from_map;
    }
    for (auto& record : map.points())
      for (int i = 0; i < 3; ++i) record.point.point_in_map[i] += random.Uniform(-distance_m, distance_m);
    return map;
  }
  struct Errors {
    double worst_keyframe_m = 0, median_point_m = 0;
  };
  static Errors Compare(Map* map) {
    Errors errors;
    for (const KeyFrame& keyframe : truth_->keyframes) {
      const Rigid3& found = map->FindKeyFrame(keyframe.id)->keyframe.camera_from_map;
      errors.worst_keyframe_m =
          std::max(errors.worst_keyframe_m,
                   (found.OriginInSource() - keyframe.camera_from_map.OriginInSource()).norm());
    }
    std::vector<double> points;
    for (const MapPoint& point : truth_->points)
      if (const auto* record = map->FindPoint(point.id))
        points.push_back((record->point.position() - point.position()).norm());
    std::nth_element(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(points.size() / 2),
                     points.end());
    errors.median_point_m = points[points.size() / 2];
    return errors;
  }
  static bool SamePoses(const MapSnapshot& a, const MapSnapshot& b) {
    for (std::size_t i = 0; i < a.keyframes.size(); ++i)
      if (!IsNear(a.keyframes[i].camera_from_map, b.keyframes[i].camera_from_map, 1e-12, 1e-12)) return false;
    return true;
  }

  static std::shared_ptr<const MapSnapshot> truth_;
};
std::shared_ptr<const MapSnapshot> MapAdjustment::truth_;

TEST_F(MapAdjustment, RemovesTheNoiseOfTheWholeMap) {
  Map map = Noisy(0.02, 0.8, 1);
  EXPECT_GT(Compare(&map).median_point_m, 0.01);
  MapAdjustmentOptions options;
  options.global_iterations = 30;
  const BundleSummary summary = AdjustGlobally(options, nullptr, &map);
  EXPECT_NE(summary.outcome, BundleSummary::Outcome::kFailed);
  EXPECT_LT(Compare(&map).worst_keyframe_m, 1e-3);
  EXPECT_LT(Compare(&map).median_point_m, 2e-3);
  EXPECT_EQ(Validate(*map.Snapshot()), "");
  EXPECT_GT(map.AlivePoints(), truth_->points.size() * 9 / 10);
}

TEST_F(MapAdjustment, KeepsTheDistancesOfThePointsWhereOneOfFewKeyframesIsFixed) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Map map = Noisy(0.01, 0.4, seed);
    map.FindKeyFrame(1)->keyframe.fixed = false;
    // The keyframes are too far from one another for the distances of the points.
    for (auto& [id, record] : map.keyframes()) {
      if (!record.keyframe.fixed) record.keyframe.camera_from_map.translation *= 1.3;
    }
    const auto before = map.Snapshot();
    for (int round = 0; round < 3; ++round) AdjustGlobally({}, nullptr, &map);
    AdjustLocally({}, 4, nullptr, &map);
    std::vector<double> ratios;
    for (const MapPoint& point : before->points) {
      if (const auto* record = map.FindPoint(point.id))
        ratios.push_back(record->point.position().norm() / point.position().norm());
    }
    EXPECT_NEAR(Median(ratios), 1, 0.002) << "seed " << seed;
    // Apart from the scale, the map becomes the true one.
    const auto distance = [&](KeyFrameId id) {
      return map.FindKeyFrame(id)->keyframe.camera_from_map.OriginInSource().norm();
    };
    EXPECT_NEAR(distance(2) / distance(1), Poses()[2].OriginInSource().norm() / 0.25, 0.01);
  }
}

TEST_F(MapAdjustment, KeepsTheDistancesOfManyKeyframesWhereOneIsFixed) {
  std::vector<Rigid3> poses;
  for (int i = 0; i < 10; ++i) poses.push_back(CameraAt({0.05 * i, 0.01 * (i % 3), 0}));
  Map map =
      testing_world::TrueMap(RenderedWorld::Room(31), testing_world::PinholeCamera(240, 180), poses, 80);
  // All points are too far away, which an adjustment of the poses and points mends.
  for (auto& record : map.points()) record.point.point_in_map.head<3>() *= 1.05;
  AdjustGlobally({}, nullptr, &map);
  double products = 0, squares = 0;
  for (int i = 0; i < 10; ++i) {
    const Eigen::Vector3d now =
        map.FindKeyFrame(static_cast<KeyFrameId>(i))->keyframe.camera_from_map.OriginInSource();
    products += now.dot(poses[static_cast<std::size_t>(i)].OriginInSource());
    squares += now.squaredNorm();
  }
  EXPECT_NEAR(products / squares, 1, 1e-9);
}

TEST_F(MapAdjustment, DoesNotMoveFixedKeyframes) {
  Map map = Noisy(0.02, 0.8, 2);
  map.FindKeyFrame(3)->keyframe.fixed = true;
  const Rigid3 wrong = map.FindKeyFrame(3)->keyframe.camera_from_map;
  AdjustGlobally({}, nullptr, &map);
  AdjustLocally({}, 3, nullptr, &map);
  AdjustLocally({}, 4, nullptr, &map);
  EXPECT_TRUE(IsNear(map.FindKeyFrame(0)->keyframe.camera_from_map, Poses()[0], 1e-12, 1e-12));
  EXPECT_TRUE(IsNear(map.FindKeyFrame(1)->keyframe.camera_from_map, Poses()[1], 1e-12, 1e-12));
  EXPECT_TRUE(IsNear(map.FindKeyFrame(3)->keyframe.camera_from_map, wrong, 1e-12, 1e-12));
}

TEST_F(MapAdjustment, AdjustsOneKeyframeAmongItsNeighbours) {
  Map map(*truth_);
  Rigid3& pose = map.FindKeyFrame(2)->keyframe.camera_from_map;
  pose = CameraAt({0.02, -0.015, 0.01}, {0.5, 0.5, -0.5}) * pose;
  MapAdjustmentOptions options;
  options.local_iterations = 20;
  AdjustLocally(options, 2, nullptr, &map);
  EXPECT_LT(Compare(&map).worst_keyframe_m, 1e-3);
  EXPECT_EQ(Validate(*map.Snapshot()), "");
}

TEST_F(MapAdjustment, MovesNothingOutsideTheWindow) {
  Map map = Noisy(0.01, 0.3, 3);
  MapAdjustmentOptions options;
  options.window = 1;
  const KeyFrameId neighbour = map.Covisible(4)[0].first;
  const auto before = map.Snapshot();
  AdjustLocally(options, 4, nullptr, &map);
  EXPECT_FALSE(IsNear(before->FindKeyFrame(4)->camera_from_map, map.FindKeyFrame(4)->keyframe.camera_from_map,
                      1e-6, 1e-6))
      << "nothing moved";
  for (const KeyFrame& keyframe : before->keyframes) {
    if (keyframe.id == 4 || keyframe.id == neighbour) continue;
    EXPECT_TRUE(IsNear(keyframe.camera_from_map, map.FindKeyFrame(keyframe.id)->keyframe.camera_from_map,
                       1e-12, 1e-12));
  }
}

TEST_F(MapAdjustment, RemovesWrongObservationsAndKeepsTheOthers) {
  Map map = Noisy(0.002, 0.1, 4);
  std::vector<std::pair<KeyFrameId, MapPointId>> wrong;
  for (const Map::PointRecord& record : map.points()) {
    if (record.observers.size() < 4 || record.point.id % 6 != 0) continue;
    const KeyFrameId observer = record.observers.back() == record.point.source_keyframe
                                    ? record.observers.front()
                                    : record.observers.back();
    for (Observation& observation : map.FindKeyFrame(observer)->observations) {
      if (observation.point != record.point.id) continue;
      const float shift = 9.0f * static_cast<float>(1 << observation.level);
      observation.pixel.x() += observation.pixel.x() > 120 ? -shift : shift;
    }
    wrong.emplace_back(observer, record.point.id);
  }
  ASSERT_GT(wrong.size(), 8u);
  const std::size_t before = map.Snapshot()->observations.size();
  MapAdjustmentOptions options;
  options.global_iterations = 30;
  const BundleSummary summary = AdjustGlobally(options, nullptr, &map);
  EXPECT_GE(summary.outliers, static_cast<int>(wrong.size()));
  for (const auto& [keyframe, point] : wrong) {
    const Map::PointRecord* record = map.FindPoint(point);
    if (!record) continue;
    EXPECT_FALSE(std::binary_search(record->observers.begin(), record->observers.end(), keyframe));
  }
  const auto after = map.Snapshot();
  EXPECT_EQ(Validate(*after), "");
  EXPECT_GT(after->observations.size(), before - 4 * wrong.size());
  EXPECT_LT(Compare(&map).worst_keyframe_m, 2e-3);
}

TEST_F(MapAdjustment, KeepsTheMapValidWhenInterrupted) {
  Map map = Noisy(0.02, 0.8, 5);
  const auto before = map.Snapshot();
  const std::atomic<bool> interrupt = true;
  for (int i = 0; i < 2; ++i) {
    const BundleSummary summary =
        i == 0 ? AdjustGlobally({}, &interrupt, &map) : AdjustLocally({}, 3, &interrupt, &map);
    EXPECT_EQ(summary.outcome, BundleSummary::Outcome::kInterrupted);
    const auto after = map.Snapshot();
    EXPECT_EQ(Validate(*after), "");
    EXPECT_EQ(after->observations.size(), before->observations.size());
    EXPECT_EQ(after->points.size(), before->points.size());
    EXPECT_TRUE(SamePoses(*before, *after));
  }
}

TEST_F(MapAdjustment, DoesNothingForEmptyMapsAndUnknownKeyframes) {
  Map empty;
  AdjustGlobally({}, nullptr, &empty);
  AdjustLocally({}, 0, nullptr, &empty);
  EXPECT_TRUE(empty.empty());
  Map map = Noisy(0.01, 0.3, 6);
  const auto before = map.Snapshot();
  EXPECT_EQ(AdjustLocally({}, 77, nullptr, &map).outcome, BundleSummary::Outcome::kFailed);
  EXPECT_TRUE(SamePoses(*before, *map.Snapshot()));
}

TEST_F(MapAdjustment, SurvivesANonFinitePose) {
  Map map = Noisy(0.005, 0.2, 7);
  map.FindKeyFrame(3)->keyframe.camera_from_map.translation.x() = std::numeric_limits<double>::quiet_NaN();
  AdjustGlobally({}, nullptr, &map);
  for (const auto& [id, record] : map.keyframes()) {
    if (id == 3) continue;
    EXPECT_TRUE(record.keyframe.camera_from_map.translation.allFinite()) << id;
  }
  for (const Map::PointRecord& record : map.points())
    if (record.alive) {
      EXPECT_TRUE(record.point.point_in_map.allFinite());
    }
}

}  // namespace
}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/map_joining.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <vector>

#include "engine/mapping/mapper.h"
#include "tests/engine/rendered_world.h"

// Two cameras go along a gallery of painted panels, each with a smaller panel in front of it, and each camera
// maps a part of it. The maps have no error, so the joined map must equal the gallery.
namespace docent::engine {
namespace {

using testing_world::CameraAt;
using testing_world::PaintedWall;
using testing_world::RenderedWorld;
using testing_world::TrueMap;
using testing_world::Wall;

using Outcome = MapOverlap::Outcome;

constexpr double kPitch = 2.0;  // metres, between panels
constexpr std::size_t kPoints = 150;

// Seeds of the panels and of the smaller ones in front of them.
RenderedWorld Gallery(const std::vector<std::uint64_t>& panels, const std::vector<std::uint64_t>& stands) {
  std::vector<Wall> walls;
  for (std::size_t i = 0; i < panels.size(); ++i) {
    const double x = kPitch * static_cast<double>(i);
    walls.push_back(PaintedWall({x, 0, 1.3}, {1, 0, 0}, {0, 1, 0}, kPitch / 2, 1.2, panels[i]));
    walls.push_back(PaintedWall({x + 0.3, 0.2, 1.0}, {1, 0, 0}, {0, 1, 0}, 0.2, 0.25, stands[i]));
  }
  return RenderedWorld(std::move(walls));
}

const std::shared_ptr<const CameraModel>& Lens() {
  static const auto lens = testing_world::PinholeCamera(400, 300);
  return lens;
}

std::vector<Rigid3> Walk(double from, double to, double step, double height) {
  std::vector<Rigid3> poses;
  for (double x = from; x <= to; x += step)
    poses.push_back(CameraAt({x, height + 0.03 * std::sin(5 * x), 0}, {0, 4 * std::sin(3 * x), 0}));
  return poses;
}

// The map of a walk, in its own coordinates and scale.
std::shared_ptr<const MapSnapshot> MapOfWalk(const RenderedWorld& world, const std::vector<Rigid3>& poses,
                                             const Sim3& own_from_world = {}) {
  Map map = TrueMap(world, Lens(), poses, kPoints);
  std::map<KeyFrameId, Sim3> moved;
  for (const auto& [id, record] : map.keyframes()) moved[id] = own_from_world;
  map.Correct(moved);
  return map.Snapshot();
}

const RenderedWorld& VariedGallery() {
  static const RenderedWorld gallery = Gallery({1, 2, 3, 4}, {11, 12, 13, 14});
  return gallery;
}

const Sim3 kOther{Rotation3::Exp({0.4, -1.1, 0.7}), {3, -2, 5}, 0.37};

struct Pair {
  std::shared_ptr<const MapSnapshot> a, b;
};
const Pair& OverlappingPair() {
  static const Pair pair = {MapOfWalk(VariedGallery(), Walk(0, 3.4, 0.2, 0)),
                            MapOfWalk(VariedGallery(), Walk(2.1, 6, 0.2, 0.1), kOther)};
  return pair;
}
const MapJoinAttempt& OverlappingAttempt() {
  static const MapJoinAttempt attempt = JoinMaps({}, *OverlappingPair().a, *OverlappingPair().b, nullptr);
  return attempt;
}

TEST(MapJoining, FindsTheSimilarityBetweenTwoMapsOfOnePlace) {
  const MapJoinAttempt& attempt = OverlappingAttempt();
  ASSERT_EQ(attempt.overlap.outcome, Outcome::kOverlap) << attempt.overlap.Brief();
  ASSERT_NE(attempt.joined, nullptr) << attempt.refusal;
  EXPECT_EQ(attempt.refusal, "");
  const Sim3 left = attempt.joined->a_from_b * kOther;
  EXPECT_LT(left.translation.norm(), 0.02);
  EXPECT_LT(left.rotation.Angle(), 0.01);
  EXPECT_NEAR(left.scale, 1, 0.01);
}

TEST(MapJoining, MakesOneAccurateMapOfBoth) {
  const MapJoinAttempt& attempt = OverlappingAttempt();
  ASSERT_NE(attempt.joined, nullptr) << attempt.refusal;
  const auto& [a, b] = OverlappingPair();
  const MapSnapshot& map = *attempt.joined->map;
  const JoinedIds& ids = attempt.joined->ids;
  EXPECT_EQ(Validate(map), "");
  EXPECT_GT(map.revision, std::max(a->revision, b->revision));
  ASSERT_EQ(map.keyframes.size(), a->keyframes.size() + b->keyframes.size());
  for (const KeyFrame& keyframe : a->keyframes) {
    EXPECT_LT((map.FindKeyFrame(keyframe.id)->camera_from_map.OriginInSource() -
               keyframe.camera_from_map.OriginInSource())
                  .norm(),
              0.01);
  }
  const Sim3 world_from_b = kOther.inverse();
  for (const KeyFrame& keyframe : b->keyframes) {
    const KeyFrame& joined = *map.FindKeyFrame(keyframe.id + ids.first_keyframe);
    EXPECT_FALSE(joined.fixed) << "the keyframes of A define the coordinate frame";
    EXPECT_LT(
        (joined.camera_from_map.OriginInSource() - world_from_b * keyframe.camera_from_map.OriginInSource())
            .norm(),
        0.02);
  }
  int astray = 0;
  for (const MapPoint& point : map.points)
    astray += VariedGallery().DistanceToSurface(point.position()) > 0.02 ? 1 : 0;
  EXPECT_LT(astray, static_cast<int>(map.points.size() / 100));
  // Common points exist once: nearly half of either map overlaps.
  EXPECT_GT(attempt.joined->points_merged, 200);
  EXPECT_LE(map.points.size() + static_cast<std::size_t>(attempt.joined->points_merged),
            a->points.size() + b->points.size());
  Map linked(map);
  int shared_across = 0;
  for (const auto& [id, record] : linked.keyframes()) {
    for (const auto& [other, shared] : linked.Covisible(id)) {
      if (id < ids.first_keyframe && other >= ids.first_keyframe)
        shared_across = std::max(shared_across, shared);
    }
  }
  EXPECT_GE(shared_across, 60);
}

TEST(MapJoining, IsDeterministic) {
  const MapJoinAttempt again = JoinMaps({}, *OverlappingPair().a, *OverlappingPair().b, nullptr);
  ASSERT_NE(again.joined, nullptr);
  const MapSnapshot &first = *OverlappingAttempt().joined->map, &second = *again.joined->map;
  ASSERT_EQ(first.points.size(), second.points.size());
  for (std::size_t i = 0; i < first.points.size(); ++i)
    EXPECT_EQ(first.points[i].point_in_map, second.points[i].point_in_map);
}

TEST(MapJoining, RejectsMapsOfDifferentPlaces) {
  const auto elsewhere = MapOfWalk(Gallery({21, 22}, {31, 32}), Walk(0, 2, 0.2, 0), kOther);
  const MapJoinAttempt attempt = JoinMaps({}, *OverlappingPair().a, *elsewhere, nullptr);
  EXPECT_EQ(attempt.joined, nullptr);
  EXPECT_NE(attempt.overlap.outcome, Outcome::kOverlap);
  EXPECT_NE(attempt.refusal, "");
}

TEST(MapJoining, RejectsASimilarPlaceWithDifferentSurfacesAroundIt) {
  // The same panel hangs in both places, but different ones hang beside it and in front of it.
  const auto a = MapOfWalk(Gallery({1, 2, 3}, {11, 12, 13}), Walk(0.6, 3.4, 0.2, 0));
  const auto b = MapOfWalk(Gallery({5, 2, 6}, {14, 15, 16}), Walk(0.7, 3.5, 0.2, 0.1), kOther);
  const MapJoinAttempt attempt = JoinMaps({}, *a, *b, nullptr);
  EXPECT_EQ(attempt.joined, nullptr) << attempt.overlap.Brief();
  EXPECT_NE(attempt.refusal, "");
  // Every keyframe sees the common panel; only the surfaces beside it differ and contradict the similarity.
  EXPECT_EQ(attempt.overlap.outcome, Outcome::kContradicted) << attempt.overlap.Brief();
  EXPECT_GT(attempt.overlap.contradicted * 5, attempt.overlap.regions) << attempt.overlap.Brief();
  MapJoiningOptions careless;
  careless.overlap.max_contradicted_ratio = 1;
  const MapJoinAttempt taken_in = JoinMaps(careless, *a, *b, nullptr);
  EXPECT_EQ(taken_in.overlap.outcome, Outcome::kOverlap) << taken_in.overlap.Brief();
}

TEST(MapJoining, RejectsAnAmbiguousOverlap) {
  const auto a = MapOfWalk(Gallery({2, 2, 2}, {12, 12, 12}), Walk(-0.4, 4.4, 0.2, 0));
  const auto b = MapOfWalk(Gallery({2, 2, 2}, {12, 12, 12}), Walk(1.7, 2.5, 0.2, 0.1), kOther);
  const MapJoinAttempt attempt = JoinMaps({}, *a, *b, nullptr);
  EXPECT_EQ(attempt.joined, nullptr);
  EXPECT_EQ(attempt.overlap.outcome, Outcome::kAmbiguous) << attempt.overlap.Brief();
}

TEST(MapJoining, ReportsAMapThatIsTooSmallToCompare) {
  MapSnapshot empty;
  EXPECT_EQ(JoinMaps({}, *OverlappingPair().a, empty, nullptr).overlap.outcome, Outcome::kNothingToCompare);
  EXPECT_EQ(JoinMaps({}, empty, *OverlappingPair().b, nullptr).overlap.outcome, Outcome::kNothingToCompare);
}

TEST(MapJoining, CanBeInterrupted) {
  const std::atomic<bool> interrupt = true;
  const MapJoinAttempt attempt = JoinMaps({}, *OverlappingPair().a, *OverlappingPair().b, &interrupt);
  EXPECT_EQ(attempt.joined, nullptr);
  EXPECT_EQ(attempt.overlap.outcome, Outcome::kInterrupted);
}

TEST(MapJoining, KeepsTheQueueOfTheMapper) {
  const auto& [a, b] = OverlappingPair();
  Mapper mapper({});
  mapper.Adopt(a);
  const KeyFrame& last = a->keyframes.back();
  KeyFrameCandidate candidate;
  candidate.time = last.time;
  candidate.camera = last.camera;
  candidate.features = last.features;
  candidate.camera_from_map = last.camera_from_map;
  ASSERT_TRUE(mapper.Offer(candidate));
  const MapJoinAttempt attempt = mapper.Join(*b, nullptr);
  ASSERT_NE(attempt.joined, nullptr) << attempt.refusal;
  EXPECT_EQ(mapper.Snapshot(), attempt.joined->map);
  EXPECT_EQ(mapper.QueueLength(), 1u);
  ASSERT_TRUE(mapper.Step());
  const auto grown = mapper.Snapshot();
  EXPECT_EQ(Validate(*grown), "");
  EXPECT_EQ(grown->keyframes.size(), a->keyframes.size() + b->keyframes.size() + 1);
  EXPECT_EQ(grown->keyframes.back().id, a->next_keyframe + b->next_keyframe) << "no id is assigned twice";
}

TEST(MapJoining, LeavesTheMapOfTheMapperUnchangedIfRejected) {
  Mapper mapper({});
  mapper.Adopt(OverlappingPair().a);
  const std::atomic<bool> interrupt = true;
  EXPECT_EQ(mapper.Join(*OverlappingPair().b, &interrupt).joined, nullptr);
  EXPECT_EQ(mapper.Join(MapSnapshot(), nullptr).joined, nullptr);
  EXPECT_EQ(mapper.Snapshot(), OverlappingPair().a);
}

TEST(MapJoining, TransformsPanoramaMapsToo) {
  // The last keyframe of B is the reference of a panorama map with one infinite point.
  const auto& [a, b] = OverlappingPair();
  Map with_panorama(*b);
  const KeyFrameId reference = b->keyframes.back().id;
  const PanoramaId panorama = with_panorama.OpenPanorama(reference);
  MapPoint direction;
  const Eigen::Vector3d ray_in_b =
      b->keyframes.back().camera_from_map.rotation.inverse() * Eigen::Vector3d::UnitZ();
  direction.point_in_map << ray_in_b, 0;
  direction.panorama = panorama;
  direction.source_keyframe = reference;
  direction.source_pixel = {199.5F, 149.5F};
  const MapPointId id = with_panorama.AddPoint(direction);
  with_panorama.AddObservation({reference, id, {199.5F, 149.5F}, 0});
  const auto before = with_panorama.Snapshot();
  ASSERT_EQ(Validate(*before), "");
  const MapJoinAttempt attempt = JoinMaps({}, *a, *before, nullptr);
  ASSERT_NE(attempt.joined, nullptr) << attempt.refusal;
  const MapSnapshot& map = *attempt.joined->map;
  EXPECT_EQ(Validate(map), "");
  ASSERT_EQ(map.panoramas.size(), 1u);
  EXPECT_EQ(map.panoramas[0].reference, reference + attempt.joined->ids.first_keyframe);
  const MapPoint* const joined = map.FindPoint(id + attempt.joined->ids.first_point);
  ASSERT_NE(joined, nullptr);
  EXPECT_TRUE(joined->infinite());
  EXPECT_GT(joined->position().dot(attempt.joined->a_from_b.rotation * ray_in_b), std::cos(0.02));
}

}  // namespace
}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loops/map_joining.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "engine/map/map_readout.h"
#include "engine/mapping/mapper.h"
#include "tests/engine/initialization/rolled_scene.h"
#include "tests/engine/mapping/loops/gallery.h"

// Two cameras go along the gallery, and each maps a part of it. The maps have no error, so the joined map
// must equal the gallery.
namespace docent::engine {
namespace {

using testing_world::Gallery;
using testing_world::InTheGallery;
using testing_world::RenderedWorld;
using testing_world::VariedGallery;

using OverlapOutcome = MapOverlap::Outcome;

// The figures of a comparison, for messages.
std::string Brief(const MapOverlap& overlap) {
  std::ostringstream text;
  text << "outcome " << static_cast<int>(overlap.outcome) << ", " << overlap.recognized
       << " keyframes recognized, " << overlap.consecutive << " consecutive, " << overlap.confirmed << " of "
       << overlap.with_view << " confirm, found ratio " << overlap.found_ratio << ", " << overlap.contradicted
       << " of " << overlap.regions << " regions contradict, points " << overlap.points << " and "
       << overlap.second_points;
  return text.str();
}

// Poses every `step` metres of a walk along the gallery.
std::vector<Rigid3> AlongTheGallery(double from, double to, double step, double height) {
  std::vector<Rigid3> poses;
  for (double x = from; x <= to; x += step) poses.push_back(InTheGallery(x, height));
  return poses;
}

// The map of a walk, in its own coordinates and scale.
std::shared_ptr<const MapSnapshot> MapOfWalk(const RenderedWorld& world, const std::vector<Rigid3>& poses,
                                             const Sim3& own_from_world = {}) {
  Map map = testing_world::MapOfGallery(world, poses);
  testing_world::Transform(own_from_world, &map);
  return map.Snapshot();
}

const Sim3 kOther{Rotation3::Exp({0.4, -1.1, 0.7}), {3, -2, 5}, 0.37};

struct MapPair {
  std::shared_ptr<const MapSnapshot> a, b;
};
const MapPair& OverlappingPair() {
  static const MapPair pair = {MapOfWalk(VariedGallery(), AlongTheGallery(0, 3.4, 0.2, 0)),
                               MapOfWalk(VariedGallery(), AlongTheGallery(2.1, 6, 0.2, 0.1), kOther)};
  return pair;
}
const MapJoinAttempt& OverlappingAttempt() {
  static const MapJoinAttempt attempt = JoinMaps({}, *OverlappingPair().a, *OverlappingPair().b, nullptr);
  return attempt;
}

TEST(MapJoining, FindsTheSimilarityBetweenTwoMapsOfOnePlace) {
  const MapJoinAttempt& attempt = OverlappingAttempt();
  ASSERT_EQ(attempt.overlap.outcome, OverlapOutcome::kOverlap) << Brief(attempt.overlap);
  ASSERT_NE(attempt.joined, nullptr) << Brief(attempt.overlap);
  EXPECT_EQ(attempt.refusal, JoinRefusal::kNone);
  const Sim3 left = attempt.joined->a_from_b * kOther;
  EXPECT_LT(left.translation.norm(), 0.02);
  EXPECT_LT(left.rotation.Angle(), 0.01);
  EXPECT_NEAR(left.scale, 1, 0.01);
}

TEST(MapJoining, MakesOneAccurateMapOfBoth) {
  const MapJoinAttempt& attempt = OverlappingAttempt();
  ASSERT_NE(attempt.joined, nullptr) << Brief(attempt.overlap);
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

TEST(MapJoining, ComparesMapsWithoutJoiningThem) {
  const MapOverlap overlap = CompareMaps({}, *OverlappingPair().a, *OverlappingPair().b, nullptr);
  ASSERT_EQ(overlap.outcome, OverlapOutcome::kOverlap) << Brief(overlap);
  const Sim3 left = overlap.a_from_b * kOther;  // Of the identity.
  EXPECT_LT(left.rotation.Angle(), 0.01);
  EXPECT_NEAR(left.scale, 1, 0.01);
  EXPECT_LT(left.translation.norm(), 0.05);
  EXPECT_EQ(CompareMaps({}, *OverlappingPair().a, MapSnapshot(), nullptr).outcome,
            OverlapOutcome::kNothingToCompare);
}

// Each keyframe is followed by one of another camera, which looks in the opposite direction at something
// else.
TEST(MapJoining, CountsConsecutiveKeyframesOfOneCameraAmongThoseOfAnother) {
  const MapSnapshot& b = *OverlappingPair().b;
  const auto other = testing_world::PinholeCamera(420, 320);
  const RenderedWorld elsewhere = Gallery({21, 22}, {31, 32});
  const KeyFrame view = testing_world::MakeKeyFrame(elsewhere, other, InTheGallery(0.5));
  const Rigid3 turned(Rotation3::Exp({0, std::numbers::pi, 0}), Eigen::Vector3d::Zero());
  MapSnapshot both = b;
  both.keyframes.clear();
  for (KeyFrame keyframe : b.keyframes) {
    keyframe.id *= 2;
    both.keyframes.push_back(keyframe);
    ++keyframe.id;
    keyframe.fixed = false;
    keyframe.camera = other;
    keyframe.features = view.features;
    keyframe.camera_from_map = turned * keyframe.camera_from_map;
    both.keyframes.push_back(keyframe);
  }
  both.next_keyframe = 2 * b.next_keyframe;
  for (MapPoint& point : both.points) point.source_keyframe *= 2;
  for (Observation& observation : both.observations) observation.keyframe *= 2;
  ASSERT_EQ(Validate(both), "");
  const MapOverlap overlap = CompareMaps({}, *OverlappingPair().a, both, nullptr);
  EXPECT_GE(overlap.consecutive, MapOverlapOptions().min_consecutive) << Brief(overlap);
  EXPECT_EQ(overlap.outcome, OverlapOutcome::kOverlap) << Brief(overlap);
}

TEST(MapJoining, IsDeterministic) {
  const MapJoinAttempt again = JoinMaps({}, *OverlappingPair().a, *OverlappingPair().b, nullptr);
  ASSERT_NE(again.joined, nullptr);
  const MapSnapshot &first = *OverlappingAttempt().joined->map, &second = *again.joined->map;
  ASSERT_EQ(first.points.size(), second.points.size());
  for (std::size_t i = 0; i < first.points.size(); ++i)
    EXPECT_EQ(first.points[i].point_in_map, second.points[i].point_in_map);
}

// Drift has displaced a part of one map, so that its keyframes do not confirm the similarity of the others.
TEST(MapJoining, JoinsMapsOfWhichOneHasDrifted) {
  Map drifted = testing_world::MapOfGallery(VariedGallery(), AlongTheGallery(2.1, 6, 0.2, 0.1));
  std::map<KeyFrameId, Sim3> moved;
  for (const auto& [id, record] : drifted.keyframes()) {
    const double x = record.keyframe.camera_from_map.OriginInSource().x();
    if (x > 2.8) moved[id] = {Rotation3(), {0, 0.4, 0}, 1};
  }
  drifted.Correct(moved);
  testing_world::Transform(kOther, &drifted);
  const auto snapshot = drifted.Snapshot();
  const MapJoinAttempt attempt = JoinMaps({}, *OverlappingPair().a, *snapshot, nullptr);
  EXPECT_EQ(attempt.overlap.outcome, OverlapOutcome::kOverlap) << Brief(attempt.overlap);
  MapJoiningOptions strict;
  strict.overlap.min_confirmed_ratio = 0.8;
  const MapJoinAttempt refused = JoinMaps(strict, *OverlappingPair().a, *snapshot, nullptr);
  EXPECT_EQ(refused.overlap.outcome, OverlapOutcome::kTooFewConfirmed) << Brief(refused.overlap);
}

TEST(MapJoining, RejectsMapsOfDifferentPlaces) {
  const auto elsewhere = MapOfWalk(Gallery({21, 22}, {31, 32}), AlongTheGallery(0, 2, 0.2, 0), kOther);
  const MapJoinAttempt attempt = JoinMaps({}, *OverlappingPair().a, *elsewhere, nullptr);
  EXPECT_EQ(attempt.joined, nullptr);
  EXPECT_NE(attempt.overlap.outcome, OverlapOutcome::kOverlap);
  EXPECT_EQ(attempt.refusal, JoinRefusal::kNoOverlap);
}

TEST(MapJoining, RejectsASimilarPlaceWithDifferentSurfacesAroundIt) {
  // The same panel hangs in both places, but different ones hang beside it and in front of it.
  const auto a = MapOfWalk(Gallery({1, 2, 3}, {11, 12, 13}), AlongTheGallery(0.6, 3.4, 0.2, 0));
  const auto b = MapOfWalk(Gallery({5, 2, 6}, {14, 15, 16}), AlongTheGallery(0.7, 3.5, 0.2, 0.1), kOther);
  const MapJoinAttempt attempt = JoinMaps({}, *a, *b, nullptr);
  EXPECT_EQ(attempt.joined, nullptr) << Brief(attempt.overlap);
  EXPECT_EQ(attempt.refusal, JoinRefusal::kNoOverlap);
  // Every keyframe sees the common panel; only the surfaces beside it differ and contradict the similarity.
  EXPECT_EQ(attempt.overlap.outcome, OverlapOutcome::kSurfacesDiffer) << Brief(attempt.overlap);
  EXPECT_GT(attempt.overlap.contradicted * 5, attempt.overlap.regions) << Brief(attempt.overlap);
  MapJoiningOptions careless;
  careless.overlap.max_contradicted_ratio = 1;
  const MapJoinAttempt taken_in = JoinMaps(careless, *a, *b, nullptr);
  EXPECT_EQ(taken_in.overlap.outcome, OverlapOutcome::kOverlap) << Brief(taken_in.overlap);
}

TEST(MapJoining, RejectsAnAmbiguousOverlap) {
  const auto a = MapOfWalk(Gallery({2, 2, 2}, {12, 12, 12}), AlongTheGallery(-0.4, 4.4, 0.2, 0));
  const auto b = MapOfWalk(Gallery({2, 2, 2}, {12, 12, 12}), AlongTheGallery(1.7, 2.5, 0.2, 0.1), kOther);
  const MapJoinAttempt attempt = JoinMaps({}, *a, *b, nullptr);
  EXPECT_EQ(attempt.joined, nullptr);
  EXPECT_EQ(attempt.overlap.outcome, OverlapOutcome::kAmbiguous) << Brief(attempt.overlap);
}

TEST(MapJoining, ReportsAMapThatIsTooSmallToCompare) {
  MapSnapshot empty;
  EXPECT_EQ(JoinMaps({}, *OverlappingPair().a, empty, nullptr).overlap.outcome,
            OverlapOutcome::kNothingToCompare);
  EXPECT_EQ(JoinMaps({}, empty, *OverlappingPair().b, nullptr).overlap.outcome,
            OverlapOutcome::kNothingToCompare);
}

TEST(MapJoining, CanBeInterrupted) {
  const std::atomic<bool> interrupt = true;
  const MapJoinAttempt attempt = JoinMaps({}, *OverlappingPair().a, *OverlappingPair().b, &interrupt);
  EXPECT_EQ(attempt.joined, nullptr);
  EXPECT_EQ(attempt.overlap.outcome, OverlapOutcome::kInterrupted);
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
  ASSERT_NE(attempt.joined, nullptr) << Brief(attempt.overlap);
  EXPECT_EQ(mapper.Snapshot(), attempt.joined->map);
  EXPECT_EQ(mapper.QueueLength(), 1u);
  ASSERT_TRUE(mapper.Step());
  const auto grown = mapper.Snapshot();
  EXPECT_EQ(Validate(*grown), "");
  EXPECT_EQ(grown->keyframes.size(), a->keyframes.size() + b->keyframes.size() + 1);
  EXPECT_EQ(grown->keyframes.back().id, a->next_keyframe + b->next_keyframe) << "no id is assigned twice";
}

// The image of a camera that turned at this rate, radians per second.
std::shared_ptr<const CameraModel> TurningImage(double rate, double readout_s) {
  return std::make_shared<CameraModel>(
      CameraModel::WithReadout(testing_world::GalleryCamera(), {{0, rate, 0}, {0, readout_s}}));
}

// The same map, whose camera turned meanwhile.
std::shared_ptr<const MapSnapshot> WithImages(const MapSnapshot& map,
                                              const std::shared_ptr<const CameraModel>& image) {
  auto turned = std::make_shared<MapSnapshot>(map);
  for (KeyFrame& keyframe : turned->keyframes) keyframe.camera = image;
  return turned;
}

// Maps a keyframe like the last one of the map, a while later, and adjusts it.
void AddKeyFrameLike(const KeyFrame& last, const std::shared_ptr<const CameraModel>& image, Mapper* mapper) {
  KeyFrameCandidate candidate;
  candidate.time = mapper->Snapshot()->keyframes.back().time + FromSeconds(1);
  candidate.camera = image;
  candidate.features = last.features;
  candidate.camera_from_map = last.camera_from_map;
  ASSERT_TRUE(mapper->Offer(candidate));
  for (int step = 0; step < 20 && !mapper->IsIdle(); ++step) mapper->Step();
  ASSERT_TRUE(mapper->IsIdle());
}

// Corners before a camera whose readout takes this long.
TrackedCorners CornersWithReadout(double readout_s) {
  testing_world::RolledScene scene;
  scene.camera = *testing_world::GalleryCamera();
  scene.readout_s.y() = readout_s;
  return {testing_world::GalleryCamera(), ShowCorners(scene)};
}

TEST(MapJoining, GivesAllImagesOfALensOneReadoutTime) {
  // So slow that the readout displaces nothing.
  const auto a = WithImages(*OverlappingPair().a, TurningImage(0.01, 0.02)),
             b = WithImages(*OverlappingPair().b, TurningImage(0.01, 0));
  const MapJoinAttempt attempt = JoinMaps({}, *a, *b, nullptr);
  ASSERT_NE(attempt.joined, nullptr) << Brief(attempt.overlap);
  for (const KeyFrame& keyframe : attempt.joined->map->keyframes)
    EXPECT_EQ(keyframe.camera->readout_motion().readout_s, Eigen::Vector2d(0, 0.02)) << keyframe.id;
}

// Corners tell a mapper the readout time once; later ones are not asked.
TEST(MapJoining, KeepsTheReadoutTimeEstimatedFromCorners) {
  const auto image = TurningImage(0.2, 0);
  const auto a = WithImages(*OverlappingPair().a, image), b = WithImages(*OverlappingPair().b, image);
  const KeyFrame& last = a->keyframes.back();
  Mapper mapper({});
  mapper.Adopt(a);
  AddKeyFrameLike(last, image, &mapper);
  ASSERT_TRUE(mapper.Offer(CornersWithReadout(0.02)));
  mapper.Step();
  const double told = ReadoutIn(*mapper.Snapshot(), *image)->y();
  ASSERT_GT(told, 0.01);
  const MapJoinAttempt attempt = mapper.Join(*b, nullptr);
  ASSERT_NE(attempt.joined, nullptr) << Brief(attempt.overlap);
  ASSERT_TRUE(mapper.Offer(CornersWithReadout(0.035)));
  mapper.Step();
  AddKeyFrameLike(last, image, &mapper);
  EXPECT_GT(ReadoutIn(*mapper.Snapshot(), *image)->y(), 0.007);
  EXPECT_LT(ReadoutIn(*mapper.Snapshot(), *image)->y(), told + 0.004);
}

MapComparison CompareOverlappingPair() {
  return CompareForJoining({}, OverlappingPair().a, OverlappingPair().b, nullptr);
}

TEST(MapJoining, JoinsAMapThatGrewAfterTheComparison) {
  const auto& [a, b] = OverlappingPair();
  const MapComparison comparison = CompareOverlappingPair();
  Mapper mapper({});
  mapper.Adopt(a);
  AddKeyFrameLike(a->keyframes.back(), a->keyframes.back().camera, &mapper);
  ASSERT_EQ(mapper.Snapshot()->next_keyframe, a->next_keyframe + 1);
  ASSERT_TRUE(mapper.StillApplies(comparison));
  const MapJoinAttempt attempt = mapper.Join(comparison, nullptr);
  ASSERT_NE(attempt.joined, nullptr) << Brief(attempt.overlap);
  EXPECT_EQ(attempt.joined->ids.first_keyframe, a->next_keyframe + 1);
  EXPECT_EQ(mapper.Snapshot(), attempt.joined->map);
  while (mapper.Step()) continue;
  const MapSnapshot& map = *mapper.Snapshot();
  EXPECT_EQ(Validate(map), "");
  EXPECT_NE(map.FindKeyFrame(a->next_keyframe), nullptr) << "the new keyframe is lost";
  EXPECT_GT(attempt.joined->points_merged, 200);
  const Sim3 world_from_b = kOther.inverse();
  for (const KeyFrame& keyframe : b->keyframes) {
    const KeyFrame* const joined = map.FindKeyFrame(keyframe.id + attempt.joined->ids.first_keyframe);
    if (!joined) continue;  // it was redundant
    EXPECT_LT(
        (joined->camera_from_map.OriginInSource() - world_from_b * keyframe.camera_from_map.OriginInSource())
            .norm(),
        0.02);
  }
}

TEST(MapJoining, WaitsUntilNewKeyframesAreAdjusted) {
  const KeyFrame& last = OverlappingPair().a->keyframes.back();
  Mapper mapper({});
  mapper.Adopt(OverlappingPair().a);
  EXPECT_TRUE(mapper.MayJoin());
  KeyFrameCandidate candidate;
  candidate.time = last.time + FromSeconds(1);
  candidate.camera = last.camera;
  candidate.features = last.features;
  candidate.camera_from_map = last.camera_from_map;
  ASSERT_TRUE(mapper.Offer(candidate));
  ASSERT_TRUE(mapper.Step());
  EXPECT_FALSE(mapper.MayJoin());
  while (mapper.Step()) continue;
  EXPECT_TRUE(mapper.MayJoin());
}

TEST(MapJoining, AComparedMapGetsTheReadoutTimeOfTheOther) {
  const auto a = WithImages(*OverlappingPair().a, TurningImage(0.01, 0.02)),
             b = WithImages(*OverlappingPair().b, TurningImage(0.01, 0));
  const MapJoinAttempt attempt = JoinCompared({}, CompareForJoining({}, a, b, nullptr), *a, nullptr);
  ASSERT_NE(attempt.joined, nullptr) << Brief(attempt.overlap);
  EXPECT_EQ(attempt.keyframes, a->keyframes.size() + b->keyframes.size());
  for (const KeyFrame& keyframe : attempt.joined->map->keyframes)
    EXPECT_EQ(keyframe.camera->readout_motion().readout_s, Eigen::Vector2d(0, 0.02)) << keyframe.id;
}

TEST(MapJoining, SaysThatComparedMapsHaveTooManyIds) {
  auto full = std::make_shared<MapSnapshot>(*OverlappingPair().b);
  full->next_point = kNoId - 1;
  const auto& a = OverlappingPair().a;
  const MapJoinAttempt attempt = JoinCompared({}, CompareForJoining({}, a, full, nullptr), *a, nullptr);
  EXPECT_EQ(attempt.joined, nullptr);
  EXPECT_EQ(attempt.refusal, JoinRefusal::kTooManyIds);
}

TEST(MapJoining, AComparisonNoLongerAppliesAfterALoopWasClosed) {
  const MapComparison comparison = CompareOverlappingPair();
  EXPECT_TRUE(StillApplies({}, comparison, *comparison.a));
  Map closed(*comparison.a);
  closed.Correct({{comparison.a->keyframes.back().id, {Rotation3(), {0.1, 0, 0}, 1}}});
  EXPECT_FALSE(StillApplies({}, comparison, *closed.Snapshot()));
}

TEST(MapJoining, AComparisonNoLongerAppliesWithoutTheKeyframesThatConfirmIt) {
  const MapComparison comparison = CompareOverlappingPair();
  Map culled(*comparison.a);
  for (const LoopCandidate& candidate : comparison.overlap.candidates)
    culled.RemoveKeyFrame(std::min(candidate.keyframe, candidate.place));
  EXPECT_FALSE(StillApplies({}, comparison, *culled.Snapshot()));
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
  ASSERT_NE(attempt.joined, nullptr) << Brief(attempt.overlap);
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

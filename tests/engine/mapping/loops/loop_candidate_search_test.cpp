// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loops/loop_candidate_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "tests/engine/geometry/test_math.h"
#include "tests/engine/geometry/transform_laws.h"
#include "tests/engine/mapping/loops/there_and_back.h"
#include "tests/engine/mapping/panorama/panorama_scene.h"

namespace docent::engine {
namespace {

using testing_world::BlankKeyFrame;
using testing_world::Gallery;
using testing_world::MapOfPlaces;
using testing_world::MapOfStretches;
using testing_world::RenderedWorld;
using testing_world::SmallDrift;
using testing_world::Stretch;
using testing_world::ThereAndBack;

using IdSet = std::set<KeyFrameId>;

// Adds points that all these keyframes observe.
void Share(int points, const std::vector<KeyFrameId>& observers, Map* map) {
  for (int i = 0; i < points; ++i) {
    MapPoint point;
    point.point_in_map = {0, 0, 2, 1};
    point.source_keyframe = observers.front();
    const MapPointId id = map->AddPoint(point);
    for (const KeyFrameId observer : observers) map->AddObservation({observer, id, {32, 32}, 0});
  }
}

// Five keyframes, each of which shares 40 points with the next one.
Map ChainOfFive() {
  Map map;
  for (int i = 0; i < 5; ++i) map.AddKeyFrame(BlankKeyFrame());
  for (KeyFrameId id = 0; id + 1 < 5; ++id) Share(40, {id, id + 1}, &map);
  return map;
}

TEST(LoopNeighbourhood, GrowsByOneLinkWithEachHop) {
  Map map = ChainOfFive();
  EXPECT_EQ(Neighbourhoods(0.2, &map).Of(0, 0), (IdSet{0}));
  EXPECT_EQ(Neighbourhoods(0.2, &map).Of(0, 1), (IdSet{0, 1}));
  EXPECT_EQ(Neighbourhoods(0.2, &map).Of(0, 2), (IdSet{0, 1, 2}));
  EXPECT_EQ(Neighbourhoods(0.2, &map).Of(2, 1), (IdSet{1, 2, 3}));
  EXPECT_EQ(Neighbourhoods(0.2, &map).Of(0, 9), (IdSet{0, 1, 2, 3, 4}));
}

TEST(LoopNeighbourhood, RequiresTheRatioOfTheOtherKeyframesPoints) {
  Map map = ChainOfFive();
  // Keyframe 1 shares 40 of its 80 points with keyframe 0, which shares all of its 40.
  EXPECT_EQ(Neighbourhoods(0.5, &map).Of(0, 1), (IdSet{0, 1}));
  EXPECT_EQ(Neighbourhoods(0.51, &map).Of(0, 1), (IdSet{0}));
  EXPECT_EQ(Neighbourhoods(0.51, &map).Of(1, 1), (IdSet{0, 1}));
}

TEST(LoopNeighbourhood, CountsThePointsSharedWithAnyOfItsKeyframes) {
  Map map;
  for (int i = 0; i < 3; ++i) map.AddKeyFrame(BlankKeyFrame());
  Share(50, {0, 1}, &map);
  Share(15, {0, 2}, &map);
  Share(15, {1, 2}, &map);
  Share(70, {2}, &map);
  EXPECT_EQ(Neighbourhoods(0.2, &map).Of(0, 1), (IdSet{0, 1})) << "15 of 100 points are too few";
  EXPECT_EQ(Neighbourhoods(0.2, &map).Of(0, 2), (IdSet{0, 1, 2})) << "30 of 100 are shared with the two";
}

TEST(LoopNeighbourhood, IgnoresInfinitePoints) {
  Map map = ChainOfFive();
  for (Map::PointRecord& record : map.points())
    if (record.observers == std::vector<KeyFrameId>{1, 2}) record.point.point_in_map = {0, 0, 1, 0};
  EXPECT_EQ(Neighbourhoods(0.2, &map).Of(0, 9), (IdSet{0, 1}));
}

// The reference of a panorama map has many of them.
TEST(LoopNeighbourhood, RequiresNoRatioOfInfinitePoints) {
  Map map;
  for (int i = 0; i < 2; ++i) map.AddKeyFrame(BlankKeyFrame());
  Share(40, {0, 1}, &map);
  Share(300, {1}, &map);
  for (Map::PointRecord& record : map.points())
    if (record.observers == std::vector<KeyFrameId>{1}) record.point.point_in_map = {0, 0, 1, 0};
  EXPECT_EQ(Neighbourhoods(0.2, &map).Of(0, 1), (IdSet{0, 1}));
}

TEST(LoopSimilarityMagnitude, IsRelativeToTheDepthAndTakesPlaceAtTheCamera) {
  KeyFrame keyframe = BlankKeyFrame(testing_world::CameraAt({1, 2, 3}, {20, -30, 10}));
  keyframe.mean_depth = 2;
  const Sim3 shift{Rotation3(), {0, 0.4, 0}, 1};
  EXPECT_NEAR(MagnitudeAt(shift, keyframe).translation, 0.2, 1e-12);
  EXPECT_NEAR(MagnitudeAt(shift, keyframe).rotation, 0, 1e-12);
  EXPECT_NEAR(MagnitudeAt(shift, keyframe).log_scale, 0, 1e-12);
  // About the camera centre itself, a rotation and a change of scale do not move the camera.
  const Eigen::Vector3d center(1, 2, 3);
  const Rotation3 rotation = Rotation3::Exp({0, -0.3, 0});
  const Sim3 turn{rotation, center - rotation * center, 1};
  EXPECT_NEAR(MagnitudeAt(turn, keyframe).translation, 0, 1e-12);
  EXPECT_NEAR(MagnitudeAt(turn, keyframe).rotation, 0.3, 1e-12);
  for (const double scale : {0.8, 1 / 0.8}) {
    const Sim3 zoom{Rotation3(), (1 - scale) * center, scale};
    EXPECT_NEAR(MagnitudeAt(zoom, keyframe).translation, 0, 1e-12);
    EXPECT_NEAR(MagnitudeAt(zoom, keyframe).log_scale, -std::log(0.8), 1e-12);
    EXPECT_NEAR(MagnitudeAt(zoom, keyframe).largest(), -std::log(0.8), 1e-12);
  }
  EXPECT_EQ((SimilarityMagnitude{1, 2, 3}.largest()), 3);
  EXPECT_EQ((SimilarityMagnitude{1, 3, 2}.largest()), 3);
  EXPECT_EQ((SimilarityMagnitude{3, 1, 2}.largest()), 3);
}

TEST(LoopKnownFromRecent, IsTheSimilarityThatTheCandidateImplies) {
  Random random(1);
  for (int trial = 0; trial < 20; ++trial) {
    Map map;
    for (int i = 0; i < 2; ++i) {
      map.AddKeyFrame(
          BlankKeyFrame(Rigid3(Rotation3::Exp(2 * RandomDirection(&random)), RandomVector(&random, 3))));
    }
    const Sim3 known_from_recent{Rotation3::Exp(RandomDirection(&random)), RandomVector(&random, 1),
                                 random.Uniform(0.5, 2)};
    LoopCandidate candidate;
    candidate.keyframe = 1;
    candidate.place = 0;
    // From the camera frame of the place to the known coordinates, to the recent ones, to the keyframe's
    // camera.
    candidate.keyframe_from_place = AsSim3(map.FindKeyFrame(1)->keyframe.camera_from_map) *
                                    known_from_recent.inverse() *
                                    AsSim3(map.FindKeyFrame(0)->keyframe.camera_from_map).inverse();
    EXPECT_LT(Difference(KnownFromRecent(candidate, &map), known_from_recent), 1e-9);
  }
}

// All candidates that a search passes on, of a keyframe whose own neighbourhood is `here`.
std::vector<LoopCandidate> AllCandidates(const LoopCandidateSearchOptions& options, KeyFrameId keyframe,
                                         const IdSet& here, Map* map) {
  LoopCandidateSearch search(options);
  PointSearcher searcher;
  std::vector<LoopCandidate> candidates;
  Neighbourhoods neighbourhoods(options.min_covisibility_ratio, map);
  search.Find(keyframe, here, &neighbourhoods, &searcher, [&](LoopCandidate candidate) {
    candidates.push_back(std::move(candidate));
    return false;
  });
  return candidates;
}
std::vector<LoopCandidate> AllCandidates(KeyFrameId keyframe, Map* map) {
  const LoopCandidateSearchOptions options;
  return AllCandidates(options, keyframe,
                       Neighbourhoods(options.min_covisibility_ratio, map).Of(keyframe, options.hops), map);
}

TEST(LoopCandidateSearch, FindsThePlaceThatTheCameraReturnedTo) {
  Map map = ThereAndBack(SmallDrift());
  for (const KeyFrameId id : testing_world::kReturned) {
    const std::vector<LoopCandidate> candidates = AllCandidates(id, &map);
    ASSERT_FALSE(candidates.empty()) << id;
    EXPECT_EQ(candidates[0].keyframe, id);
    const auto& beginning = testing_world::kBeginning;
    EXPECT_NE(std::find(beginning.begin(), beginning.end(), candidates[0].place), beginning.end())
        << candidates[0].place;
    // It undoes the drift wherever the keyframe can see.
    const Sim3 left = KnownFromRecent(candidates[0], &map) * SmallDrift();
    for (const Eigen::Vector3d& place : {Eigen::Vector3d(-0.5, 0, 1.3), Eigen::Vector3d(1.2, 0.4, 1.0)})
      EXPECT_LT((left * place - place).norm(), 0.02) << id;
  }
}

TEST(LoopCandidateSearch, FindsNothingAmongTheKeyframesThatAreExcluded) {
  Map map = ThereAndBack(SmallDrift());
  const KeyFrameId id = testing_world::kReturned[1];
  const LoopCandidateSearchOptions options;
  IdSet here = Neighbourhoods(options.min_covisibility_ratio, &map).Of(id, options.hops);
  ASSERT_FALSE(AllCandidates(options, id, here, &map).empty());
  // Keyframes 0 to 5 show what the keyframe shows.
  for (KeyFrameId known = 0; known <= 5; ++known) here.insert(known);
  EXPECT_TRUE(AllCandidates(options, id, here, &map).empty());
}

TEST(LoopCandidateSearch, FindsNothingForAPlaceThatTheMapDoesNotContain) {
  const std::vector<double> places = {0.5, 0.3, 0.1};
  const auto elsewhere = MapOfPlaces(Gallery({21, 22}, {31, 32}), places);
  Map map =
      MapOfStretches(std::vector<Stretch>{{testing_world::WayOut(), {}}, {elsewhere, SmallDrift(), false}});
  for (KeyFrameId id = 9; id < 12; ++id) EXPECT_TRUE(AllCandidates(id, &map).empty()) << id;
}

// All panels are painted alike, so that the keyframe's image shows several places.
class LoopCandidateSearchInARepeatingGallery : public testing::Test {
 protected:
  static Map RepeatingMap() {
    const std::vector<double> first = {0, 0.2, 0.4, 0.6, 1.1, 1.6, 2.0, 2.2, 2.4, 2.6, 3.1, 3.6};
    const std::vector<double> second = {0.5, 0.3, 0.1};
    const RenderedWorld gallery = Gallery({1, 1, 1}, {11, 11, 11});
    return MapOfStretches(
        std::vector<Stretch>{{MapOfPlaces(gallery, first), {}}, {MapOfPlaces(gallery, second), {}, false}});
  }
  static constexpr KeyFrameId kSearched = 13;
};

TEST_F(LoopCandidateSearchInARepeatingGallery, PassesEveryPlaceOnUntilOneIsTaken) {
  Map map = RepeatingMap();
  LoopCandidateSearch search({});
  PointSearcher searcher;
  std::vector<double> places;
  bool take = false;
  const auto note = [&](const LoopCandidate& candidate) {
    places.push_back(map.FindKeyFrame(candidate.place)->keyframe.camera_from_map.OriginInSource().x());
    return take;
  };
  const IdSet here = {12, 13, 14};
  Neighbourhoods neighbourhoods(LoopCandidateSearchOptions().min_covisibility_ratio, &map);
  search.Find(kSearched, here, &neighbourhoods, &searcher, note);
  ASSERT_EQ(places.size(), 2u);
  EXPECT_GT(std::abs(places[0] - places[1]), 1.0) << "two keyframes of one place are one candidate";
  take = true;
  search.Find(kSearched, here, &neighbourhoods, &searcher, note);
  EXPECT_EQ(places.size(), 3u);
}

TEST_F(LoopCandidateSearchInARepeatingGallery, PassesThePlaceWithMostMatchesFirst) {
  for (const bool first_panel : {true, false}) {
    Map map = RepeatingMap();
    // The other panel keeps half of its points.
    std::vector<MapPointId> removed;
    for (const Map::PointRecord& record : map.points()) {
      const bool on_first_panel = record.point.position().x() < 0.5 * testing_world::kPanelDistance;
      if (record.observers.front() < 12 && on_first_panel != first_panel && record.point.id % 2 == 0)
        removed.push_back(record.point.id);
    }
    for (const MapPointId id : removed) map.RemovePoint(id);
    const auto candidates = AllCandidates({}, kSearched, {12, 13, 14}, &map);
    ASSERT_FALSE(candidates.empty());
    const double x = map.FindKeyFrame(candidates[0].place)->keyframe.camera_from_map.OriginInSource().x();
    EXPECT_EQ(x < 0.5 * testing_world::kPanelDistance, first_panel) << x;
  }
}

TEST_F(LoopCandidateSearchInARepeatingGallery, VerifiesNoMorePlacesThanAllowed) {
  Map map = RepeatingMap();
  LoopCandidateSearchOptions options;
  options.max_verified = 1;
  EXPECT_EQ(AllCandidates(options, kSearched, {12, 13, 14}, &map).size(), 1u);
  options.max_verified = 2;
  EXPECT_EQ(AllCandidates(options, kSearched, {12, 13, 14}, &map).size(), 2u);
}

}  // namespace
}  // namespace docent::engine

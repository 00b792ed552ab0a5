// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loops/loop_detector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "tests/engine/mapping/loops/there_and_back.h"

namespace docent::engine {
namespace {

using testing_world::Gallery;
using testing_world::kReturned;
using testing_world::MapOfPlaces;
using testing_world::MapOfStretches;
using testing_world::RenderedWorld;
using testing_world::SmallDrift;
using testing_world::Stretch;
using testing_world::ThereAndBack;
using testing_world::WayBack;
using testing_world::WayOut;

// The keyframes whose candidates complete a loop when these keyframes are examined in this order; empty
// entries are left out.
std::vector<std::vector<KeyFrameId>> LoopsOf(const std::vector<KeyFrameId>& keyframes, Map* map,
                                             const LoopDetectorOptions& options = {}) {
  LoopDetector detector(options);
  PointSearcher searcher;
  std::vector<std::vector<KeyFrameId>> loops;
  for (const KeyFrameId id : keyframes) {
    std::vector<KeyFrameId> series;
    for (const LoopCandidate& candidate : detector.Detect(id, map, &searcher))
      series.push_back(candidate.keyframe);
    if (!series.empty()) loops.push_back(series);
  }
  return loops;
}
using Loops = std::vector<std::vector<KeyFrameId>>;

const std::vector<KeyFrameId> kInOrder(kReturned.begin(), kReturned.end());

// A drift that leaves the camera at 0.3 m along the gallery where it is.
Sim3 DriftAboutTheBeginning(const Eigen::Vector3d& rotation, double scale) {
  const Eigen::Vector3d center(0.3, 0, 0);
  const Rotation3 turn = Rotation3::Exp(rotation);
  return {turn, center - scale * (turn * center), scale};
}

TEST(LoopDetector, RequiresThreeKeyframesInARow) {
  Map map = ThereAndBack(SmallDrift());
  LoopDetector detector({});
  PointSearcher searcher;
  EXPECT_TRUE(detector.Detect(kReturned[0], &map, &searcher).empty());
  EXPECT_TRUE(detector.Detect(kReturned[1], &map, &searcher).empty());
  const std::vector<LoopCandidate> loop = detector.Detect(kReturned[2], &map, &searcher);
  ASSERT_EQ(loop.size(), 3u);
  const auto& beginning = testing_world::kBeginning;
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(loop[i].keyframe, kReturned[i]);
    EXPECT_NE(std::find(beginning.begin(), beginning.end(), loop[i].place), beginning.end()) << loop[i].place;
    const Eigen::Vector3d place(0.3, 0, 1.3);
    EXPECT_LT((KnownFromRecent(loop[i], &map) * (SmallDrift() * place) - place).norm(), 0.02);
  }
  // It starts anew.
  EXPECT_TRUE(detector.Detect(kReturned[0], &map, &searcher).empty());
}

TEST(LoopDetector, StartsAnewAfterAKeyframeThatShowsNothingKnown) {
  const std::vector<double> somewhere = {0.3};
  const auto elsewhere = MapOfPlaces(Gallery({21, 22}, {31, 32}), somewhere);
  Map map = MapOfStretches(
      std::vector<Stretch>{{WayOut(), {}}, {WayBack(), SmallDrift()}, {elsewhere, SmallDrift(), false}});
  constexpr KeyFrameId kElsewhere = 17;
  EXPECT_EQ(LoopsOf({14, 15, kElsewhere, 16}, &map), Loops{});
  EXPECT_EQ(LoopsOf({14, 15, kElsewhere, 16, 15, 14}, &map), (Loops{{16, 15, 14}}));
}

// The keyframes of all cameras are examined in the order in which they come.
TEST(LoopDetector, GoesOnAfterAKeyframeOfAnotherCameraThatShowsNothingKnown) {
  const std::vector<double> somewhere = {0.3};
  const auto elsewhere = MapOfPlaces(Gallery({21, 22}, {31, 32}), somewhere);
  Map map = MapOfStretches(
      std::vector<Stretch>{{WayOut(), {}}, {WayBack(), SmallDrift()}, {elsewhere, SmallDrift(), false}});
  constexpr KeyFrameId kElsewhere = 17;
  KeyFrame& keyframe = map.FindKeyFrame(kElsewhere)->keyframe;
  CameraModel::Intrinsics intrinsics = keyframe.camera->intrinsics();
  intrinsics.fx += 1;
  keyframe.camera =
      std::make_shared<const CameraModel>(keyframe.camera->lens(), intrinsics, keyframe.camera->distortion());
  EXPECT_EQ(LoopsOf({14, 15, kElsewhere, 16}, &map), Loops{kInOrder});
  EXPECT_EQ(LoopsOf({14, kElsewhere, kElsewhere, 15}, &map), Loops{}) << "it does not count";
}

TEST(LoopDetector, ForgetsItsCandidatesWhenItIsCleared) {
  Map map = ThereAndBack(SmallDrift());
  LoopDetector detector({});
  PointSearcher searcher;
  EXPECT_TRUE(detector.Detect(14, &map, &searcher).empty());
  EXPECT_TRUE(detector.Detect(15, &map, &searcher).empty());
  detector.Clear();
  EXPECT_TRUE(detector.Detect(16, &map, &searcher).empty());
  EXPECT_TRUE(detector.Detect(15, &map, &searcher).empty());
  EXPECT_EQ(detector.Detect(14, &map, &searcher).size(), 3u);
}

TEST(LoopDetector, RequiresCandidatesThatAgreeOnTheError) {
  // The last stretch has drifted by another sixth of a metre.
  Sim3 further = SmallDrift();
  further.translation.x() += 0.16;
  const std::vector<double> last_places = {0.15, 0.5, 0.35, 0.2};
  const auto last = MapOfPlaces(testing_world::VariedGallery(), last_places);
  Map map = MapOfStretches(std::vector<Stretch>{{WayOut(), {}}, {WayBack(), SmallDrift()}, {last, further}});
  EXPECT_EQ(LoopsOf({14, 15, 18}, &map), Loops{});
  EXPECT_EQ(LoopsOf({14, 15, 18, 19, 20}, &map), (Loops{{18, 19, 20}}));
  LoopDetectorOptions tolerant;
  tolerant.max_disagreement = 0.5;
  EXPECT_EQ(LoopsOf({14, 15, 18}, &map, tolerant), (Loops{{14, 15, 18}}));
}

// An adjustment moves the first keyframe alone, so that its candidate implies another error than the others.
TEST(LoopDetector, LeavesOutAFirstCandidateThatTheNewestContradicts) {
  Map map = ThereAndBack(SmallDrift());
  LoopDetector detector({});
  PointSearcher searcher;
  EXPECT_TRUE(detector.Detect(14, &map, &searcher).empty());
  EXPECT_TRUE(detector.Detect(15, &map, &searcher).empty());
  map.FindKeyFrame(14)->keyframe.camera_from_map.translation.x() += 0.2;
  EXPECT_TRUE(detector.Detect(16, &map, &searcher).empty());
  std::vector<KeyFrameId> series;
  for (const LoopCandidate& candidate : detector.Detect(15, &map, &searcher))
    series.push_back(candidate.keyframe);
  EXPECT_EQ(series, (std::vector<KeyFrameId>{15, 16, 15}));
}

TEST(LoopDetector, IgnoresErrorsThatGuidedSearchCopesWith) {
  Map map = ThereAndBack({});
  EXPECT_EQ(LoopsOf(kInOrder, &map), Loops{});
  LoopDetectorOptions options;
  options.min_error = 0;
  EXPECT_EQ(LoopsOf(kInOrder, &map, options), Loops{kInOrder});
}

TEST(LoopDetector, RefusesAnErrorThatIsLargeForThePath) {
  // The path from the beginning to the end of the gallery and back is about five and a half metres long.
  Map within = ThereAndBack({Rotation3(), {0, 0, 0.4}, 1});
  EXPECT_EQ(LoopsOf(kInOrder, &within), Loops{kInOrder});
  Map beyond = ThereAndBack({Rotation3(), {0, 0, 0.7}, 1});
  EXPECT_EQ(LoopsOf(kInOrder, &beyond), Loops{});
  // The same error as in the first map, where the camera turned back: the path between is short.
  EXPECT_EQ(LoopsOf({10, 11, 12}, &within), Loops{});
}

TEST(LoopDetector, RefusesARotationThatIsNoDrift) {
  for (const double radians : {0.25, 0.45}) {
    Map map = ThereAndBack(DriftAboutTheBeginning({0, 0, radians}, 1));
    const bool is_drift = radians < LoopDetectorOptions().max_rotation;
    EXPECT_EQ(LoopsOf(kInOrder, &map), is_drift ? Loops{kInOrder} : Loops{}) << radians;
  }
}

TEST(LoopDetector, RefusesAScaleThatIsNoDrift) {
  for (const double log_scale : {-0.5, -0.3, 0.3, 0.5}) {
    Map map = ThereAndBack(DriftAboutTheBeginning({0, 0, 0}, std::exp(log_scale)));
    const bool is_drift = std::abs(log_scale) < LoopDetectorOptions().max_log_scale;
    EXPECT_EQ(LoopsOf(kInOrder, &map), is_drift ? Loops{kInOrder} : Loops{}) << log_scale;
  }
}

// The gallery shows the same panel again four metres further on. Geometry cannot tell the two apart, but a
// camera does not drift by four metres on its way from one to the other.
TEST(LoopDetector, RefusesAPlaceThatLooksLikeAnother) {
  const RenderedWorld repeating = Gallery({1, 2, 1, 3}, {11, 12, 11, 13});
  const std::vector<double> places = {0, 0.2, 0.4, 0.6, 1.1, 1.6, 2.1, 2.6, 3.1, 3.6, 4.1, 4.3, 4.5};
  Map map(*MapOfPlaces(repeating, places));
  const std::vector<KeyFrameId> at_the_second = {10, 11, 12};
  EXPECT_EQ(LoopsOf(at_the_second, &map), Loops{});
  LoopDetectorOptions credulous;
  credulous.max_translation = 10;
  EXPECT_EQ(LoopsOf(at_the_second, &map, credulous), Loops{at_the_second});
}

TEST(LoopDetector, IgnoresKeyframesWithoutAPosition) {
  Map map = ThereAndBack(SmallDrift());
  EXPECT_EQ(LoopsOf({14, 999, 15, 999, 16}, &map), Loops{kInOrder}) << "there is no such keyframe";
  KeyFrame dependent = map.FindKeyFrame(15)->keyframe;
  dependent.kind = KeyFrameKind::kPanorama;
  const KeyFrameId rotated = map.AddKeyFrame(dependent).keyframe.id;
  EXPECT_EQ(LoopsOf({14, rotated, 16, rotated}, &map), Loops{}) << "it does not count";
  EXPECT_EQ(LoopsOf({14, rotated, 15, 16}, &map), Loops{kInOrder}) << "nor does it interrupt";
}

TEST(LoopDetector, DropsCandidatesOfKeyframesThatWereRemoved) {
  Map map = ThereAndBack(SmallDrift());
  LoopDetector detector({});
  PointSearcher searcher;
  EXPECT_TRUE(detector.Detect(14, &map, &searcher).empty());
  EXPECT_TRUE(detector.Detect(15, &map, &searcher).empty());
  map.RemoveKeyFrame(14);
  EXPECT_TRUE(detector.Detect(16, &map, &searcher).empty()) << "only two are left";
}

}  // namespace
}  // namespace docent::engine

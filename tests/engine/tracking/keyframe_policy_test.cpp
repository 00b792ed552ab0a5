// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/keyframe_policy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/engine/geometry/test_math.h"
#include "tests/engine/rendered_world.h"

// Tests each transition of Fig. 3 of hybrid-slam and each threshold from both sides. Poses and snapshots are
// made up; no images are needed.
namespace docent::engine {
namespace {

using testing_world::CameraAt;
using Mode = KeyFramePolicy::Mode;

const double kFieldOfView = Radians(70);
constexpr double kViewTurnDeg = 14;        // 0.2 of the field of view
constexpr double kSmallViewTurnDeg = 2.1;  // 0.03 of it
constexpr double kPointDepth = 2;          // metres
// Rays from two centres this far apart to a point in front of the middle between them have the parallax at
// which a camera has translated.
const double kParallaxDistance =
    2 * kPointDepth * std::tan(Radians(KeyFramePolicyOptions().min_parallax_deg / 2));

Rigid3 RotatedBy(double degrees, const Eigen::Vector3d& center = Eigen::Vector3d::Zero()) {
  return CameraAt(center, {0, degrees, 0});
}

KeyFrame SixDof(KeyFrameId id, double seconds, const Rigid3& pose, PanoramaId panorama = kNoId) {
  KeyFrame keyframe;
  keyframe.id = id;
  keyframe.time = FromSeconds(seconds);
  keyframe.camera_from_map = pose;
  keyframe.panorama = panorama;
  return keyframe;
}
KeyFrame Dependent(KeyFrameId id, double seconds, const Rigid3& pose, PanoramaId panorama) {
  KeyFrame keyframe = SixDof(id, seconds, pose, panorama);
  keyframe.kind = KeyFrameKind::kPanorama;
  return keyframe;
}

// One keyframe at the origin with its optical axis along z.
MapSnapshot PlainMap() {
  MapSnapshot map;
  map.keyframes = {SixDof(0, 0, RotatedBy(0))};
  return map;
}
// The same, with panorama map 3, which was opened at 1 s; its reference is at the origin, rotated by 20
// degrees.
MapSnapshot OpenedMap() {
  MapSnapshot map = PlainMap();
  map.keyframes.push_back(SixDof(1, 1, RotatedBy(20), 3));
  map.panoramas = {{3, 1}};
  return map;
}

// A frame that the map covers completely, so that no keyframe is wanted.
PolicyFrame CoveredFrame(double seconds, const Rigid3& pose) {
  PolicyFrame frame;
  frame.time = FromSeconds(seconds);
  frame.camera_from_map = pose;
  frame.points = 200;
  frame.median_depth = kPointDepth;
  return frame;
}
// A frame of which the map covers only half.
PolicyFrame HalfCovered(double seconds, const Rigid3& pose) {
  PolicyFrame frame = CoveredFrame(seconds, pose);
  frame.finite_coverage = frame.coverage = 0.5;
  return frame;
}
// A frame that is tracked by infinite points only.
PolicyFrame RotationOnly(double seconds, const Rigid3& pose, double coverage = 0.5) {
  PolicyFrame frame = CoveredFrame(seconds, pose);
  frame.observed = ObservedMotion::kPanorama;
  frame.finite_coverage = 0;
  frame.coverage = coverage;
  return frame;
}

class KeyFramePolicyTest : public ::testing::Test {
 protected:
  // The choice for `frame` after a well covered frame at 1 s with the pose `before`.
  static KeyFrameChoice ChoiceAfterRotation(const PolicyFrame& frame, const MapSnapshot& map,
                                            const Rigid3& before = RotatedBy(0)) {
    KeyFramePolicy policy({}, kFieldOfView);
    EXPECT_EQ(policy.Select(CoveredFrame(1, before), map), KeyFrameChoice::kNone);
    return policy.Select(frame, map);
  }
  // Opens the panorama map of OpenedMap().
  void Open() {
    policy_.Accepted(KeyFrameChoice::kLocalizedPanorama, FromSeconds(1));
    ASSERT_EQ(policy_.mode(), Mode::kPanorama);
    ASSERT_EQ(policy_.OpenPanorama(OpenedMap()), 3u);
  }

  KeyFramePolicy policy_{{}, kFieldOfView};
};

TEST_F(KeyFramePolicyTest, StartsInSixDofMode) {
  EXPECT_EQ(policy_.mode(), Mode::kSixDof);
  EXPECT_EQ(policy_.OpenPanorama(OpenedMap()), kNoId);
}

TEST_F(KeyFramePolicyTest, PassesOnTheRequestForAnOrdinaryKeyframe) {
  PolicyFrame frame = CoveredFrame(1, RotatedBy(0, {0.4, 0, 0}));
  EXPECT_EQ(policy_.Select(frame, PlainMap()), KeyFrameChoice::kNone);
  frame.needs_six_dof = true;
  EXPECT_EQ(policy_.Select(frame, PlainMap()), KeyFrameChoice::kSixDof);
  policy_.Accepted(KeyFrameChoice::kSixDof, frame.time);
  EXPECT_EQ(policy_.mode(), Mode::kSixDof);
}

TEST_F(KeyFramePolicyTest, OpensAPanoramaAfterAPureRotationIntoUnmappedSpace) {
  const MapSnapshot map = PlainMap();
  EXPECT_EQ(ChoiceAfterRotation(HalfCovered(2, RotatedBy(kViewTurnDeg - 0.1)), map), KeyFrameChoice::kNone);
  EXPECT_EQ(ChoiceAfterRotation(HalfCovered(2, RotatedBy(kViewTurnDeg + 0.1)), map),
            KeyFrameChoice::kLocalizedPanorama);
  EXPECT_EQ(ChoiceAfterRotation(HalfCovered(2, RotatedBy(-kViewTurnDeg - 0.1)), map),
            KeyFrameChoice::kLocalizedPanorama);
  // A rotation downwards counts too, but a rotation about the optical axis shows nothing new.
  EXPECT_EQ(ChoiceAfterRotation(HalfCovered(2, CameraAt({0, 0, 0}, {15, 0, 0})), map),
            KeyFrameChoice::kLocalizedPanorama);
  EXPECT_EQ(ChoiceAfterRotation(HalfCovered(2, CameraAt({0, 0, 0}, {0, 0, 60})), map), KeyFrameChoice::kNone);
}

TEST_F(KeyFramePolicyTest, OpensNoPanoramaWhileTheMapCoversTheImage) {
  const MapSnapshot map = PlainMap();
  PolicyFrame frame = HalfCovered(2, RotatedBy(30));
  frame.finite_coverage = 0.75;
  EXPECT_EQ(ChoiceAfterRotation(frame, map), KeyFrameChoice::kNone);
  frame.finite_coverage = 0.74;
  EXPECT_EQ(ChoiceAfterRotation(frame, map), KeyFrameChoice::kLocalizedPanorama);
  // Infinite points of an earlier panorama map cover what finite points do not.
  frame.coverage = 0.8;
  EXPECT_EQ(ChoiceAfterRotation(frame, map), KeyFrameChoice::kNone);
  frame.coverage = 0.79;
  EXPECT_EQ(ChoiceAfterRotation(frame, map), KeyFrameChoice::kLocalizedPanorama);
}

TEST_F(KeyFramePolicyTest, DoesNotTakeTranslationForPureRotation) {
  const MapSnapshot map = PlainMap();
  for (const double sign : {-1.0, 1.0}) {
    const auto from = [&](double distance) { return RotatedBy(0, {sign * distance, 0, 0}); };
    PolicyFrame frame = HalfCovered(2, RotatedBy(20));
    EXPECT_EQ(ChoiceAfterRotation(frame, map, from(0.99 * kParallaxDistance)),
              KeyFrameChoice::kLocalizedPanorama);
    EXPECT_EQ(ChoiceAfterRotation(frame, map, from(1.01 * kParallaxDistance)), KeyFrameChoice::kNone);
    // At twice the depth, the same translation counts as a pure rotation.
    frame.median_depth = 2 * kPointDepth;
    EXPECT_EQ(ChoiceAfterRotation(frame, map, from(1.01 * kParallaxDistance)),
              KeyFrameChoice::kLocalizedPanorama);
  }
}

TEST_F(KeyFramePolicyTest, IgnoresRotationsOlderThanTheHistory) {
  const MapSnapshot map = PlainMap();
  EXPECT_EQ(ChoiceAfterRotation(HalfCovered(10.9, RotatedBy(20)), map), KeyFrameChoice::kLocalizedPanorama);
  // The pose at 1 s leaves the history when the pose at 11.1 s enters it, so that the next frame no longer
  // sees the
  // rotation.
  EXPECT_EQ(policy_.Select(CoveredFrame(1, RotatedBy(0)), map), KeyFrameChoice::kNone);
  EXPECT_EQ(policy_.Select(CoveredFrame(11.1, RotatedBy(20)), map), KeyFrameChoice::kNone);
  EXPECT_EQ(policy_.Select(HalfCovered(11.2, RotatedBy(20)), map), KeyFrameChoice::kNone);
}

// With parallax to every keyframe, points of an ordinary keyframe can be triangulated, so that it is the
// better choice (§4.2).
TEST_F(KeyFramePolicyTest, PrefersAnOrdinaryKeyframeWithParallax) {
  const auto choose = [&](double distance, MapSnapshot map) {
    PolicyFrame frame = HalfCovered(2, RotatedBy(20, {distance, 0, 0}));
    frame.needs_six_dof = true;
    return ChoiceAfterRotation(frame, map, RotatedBy(0, {distance, 0, 0}));
  };
  EXPECT_EQ(choose(0.99 * kParallaxDistance, PlainMap()), KeyFrameChoice::kLocalizedPanorama);
  EXPECT_EQ(choose(1.01 * kParallaxDistance, PlainMap()), KeyFrameChoice::kSixDof);
  // The position of a dependent keyframe is unknown, so that its parallax is not considered.
  MapSnapshot map = PlainMap();
  map.keyframes.push_back(SixDof(1, 0.5, RotatedBy(90, {-3, 0, 0}), 0));
  map.keyframes.push_back(Dependent(2, 0.6, RotatedBy(90, {1.01 * kParallaxDistance, 0, 0}), 0));
  map.panoramas = {{0, 1}};
  EXPECT_EQ(choose(1.01 * kParallaxDistance, map), KeyFrameChoice::kSixDof);
}

TEST_F(KeyFramePolicyTest, OpensAPanoramaImmediatelyWhenFewPointsAreLeft) {
  PolicyFrame frame = HalfCovered(1, RotatedBy(0));
  frame.points = 60;
  EXPECT_EQ(policy_.Select(frame, PlainMap()), KeyFrameChoice::kNone);
  frame.points = 59;
  EXPECT_EQ(policy_.Select(frame, PlainMap()), KeyFrameChoice::kLocalizedPanorama);
  // Few points spread over the whole image mean low texture, and a panorama map nearby suffices.
  frame.finite_coverage = 0.75;
  EXPECT_EQ(policy_.Select(frame, PlainMap()), KeyFrameChoice::kNone);
  frame.finite_coverage = 0.5;
  EXPECT_EQ(policy_.Select(frame, OpenedMap()), KeyFrameChoice::kNone);
}

TEST_F(KeyFramePolicyTest, OpensAPanoramaOnlyByARotationWithFewPointsIfBothAreNeeded) {
  KeyFramePolicyOptions options;
  options.opens_by_rotation_with_few_points = true;
  const MapSnapshot map = PlainMap();
  const auto choose = [&](double turn, int points) {
    KeyFramePolicy policy(options, kFieldOfView);
    policy.Select(CoveredFrame(1, RotatedBy(0)), map);
    PolicyFrame frame = HalfCovered(2, RotatedBy(turn));
    frame.points = points;
    frame.needs_six_dof = true;
    return policy.Select(frame, map);
  };
  EXPECT_EQ(choose(0, 59), KeyFrameChoice::kSixDof);
  EXPECT_EQ(choose(kViewTurnDeg + 0.1, 60), KeyFrameChoice::kSixDof);
  EXPECT_EQ(choose(kViewTurnDeg + 0.1, 59), KeyFrameChoice::kLocalizedPanorama);
}

// What always moves, such as leaves or water, would fill the memory.
TEST_F(KeyFramePolicyTest, AddsOnlySoManyKeyframesInOneDirectionOfAMapWithoutDepth) {
  Open();
  MapSnapshot map = OpenedMap();
  const auto choose = [&](double seconds, double turn_deg) {
    PolicyFrame frame = RotationOnly(seconds, RotatedBy(turn_deg));
    frame.points = 20;
    return policy_.Select(frame, map);
  };
  int added = 0;
  for (double seconds = 2; choose(seconds, 20) == KeyFrameChoice::kPanorama; seconds += 0.2) {
    map.keyframes.push_back(
        Dependent(static_cast<KeyFrameId>(map.keyframes.size()), seconds, RotatedBy(20), 3));
    ASSERT_LT(++added, 100);
  }
  EXPECT_EQ(added + 1, KeyFramePolicyOptions().max_without_rotation) << "one is there already";
  EXPECT_EQ(choose(200, 30), KeyFrameChoice::kPanorama);
}

TEST_F(KeyFramePolicyTest, OffersNothingWhileAClosedPanoramaTracksTheCamera) {
  PolicyFrame frame = RotationOnly(2, RotatedBy(30));
  frame.needs_six_dof = true;
  EXPECT_EQ(ChoiceAfterRotation(frame, OpenedMap()), KeyFrameChoice::kNone);
}

TEST_F(KeyFramePolicyTest, IsInPanoramaModeAfterOfferingOne) {
  for (const KeyFrameChoice choice : {KeyFrameChoice::kLocalizedPanorama, KeyFrameChoice::kFirst}) {
    KeyFramePolicy policy({}, kFieldOfView);
    policy.Accepted(choice, FromSeconds(1));
    EXPECT_EQ(policy.mode(), Mode::kPanorama);
    // The mapper has not made the panorama map yet.
    EXPECT_EQ(policy.OpenPanorama(PlainMap()), kNoId);
    EXPECT_EQ(policy.Select(RotationOnly(2, RotatedBy(60)), PlainMap()), KeyFrameChoice::kNone);
    EXPECT_EQ(policy.OpenPanorama(OpenedMap()), 3u);
    EXPECT_EQ(policy.Select(RotationOnly(2, RotatedBy(60)), OpenedMap()), KeyFrameChoice::kPanorama);
    // Another keyframe of the panorama map does not change the mode.
    policy.Accepted(KeyFrameChoice::kPanorama, FromSeconds(2));
    EXPECT_EQ(policy.mode(), Mode::kPanorama);
    EXPECT_EQ(policy.OpenPanorama(OpenedMap()), 3u);
  }
  // A choice that was not offered does not change the mode.
  EXPECT_EQ(ChoiceAfterRotation(HalfCovered(2, RotatedBy(20)), PlainMap()),
            KeyFrameChoice::kLocalizedPanorama);
  EXPECT_EQ(policy_.mode(), Mode::kSixDof);
}

TEST_F(KeyFramePolicyTest, AddsPanoramaKeyframesWhereCoverageIsLow) {
  Open();
  EXPECT_EQ(policy_.Select(RotationOnly(2, RotatedBy(60), 0.8), OpenedMap()), KeyFrameChoice::kNone);
  EXPECT_EQ(policy_.Select(RotationOnly(2, RotatedBy(60), 0.79), OpenedMap()), KeyFrameChoice::kPanorama);
}

TEST_F(KeyFramePolicyTest, AddsPanoramaKeyframesOnlyForNewViewingDirections) {
  Open();
  MapSnapshot map = OpenedMap();
  const auto at = [&](double degrees) { return policy_.Select(RotationOnly(2, RotatedBy(degrees)), map); };
  EXPECT_EQ(at(20 + kViewTurnDeg - 0.1), KeyFrameChoice::kNone);
  EXPECT_EQ(at(20 + kViewTurnDeg + 0.1), KeyFrameChoice::kPanorama);
  EXPECT_EQ(at(20 - kViewTurnDeg - 0.1), KeyFrameChoice::kPanorama);
  map.keyframes.push_back(Dependent(2, 2, RotatedBy(40), 3));
  EXPECT_EQ(at(40), KeyFrameChoice::kNone);
  EXPECT_EQ(at(40 + kViewTurnDeg + 0.1), KeyFrameChoice::kPanorama);
  // Keyframes of another panorama map and ordinary keyframes are ignored.
  map.keyframes.push_back(SixDof(3, 3, RotatedBy(80), 4));
  map.keyframes.push_back(SixDof(4, 4, RotatedBy(80)));
  map.panoramas.push_back({4, 3});
  EXPECT_EQ(at(80), KeyFrameChoice::kPanorama);
}

TEST_F(KeyFramePolicyTest, AddsPanoramaKeyframesSoonerWhenFewPointsAreLeft) {
  Open();
  const auto choose = [&](double degrees, int points) {
    PolicyFrame frame = RotationOnly(2, RotatedBy(20 + degrees));
    frame.points = points;
    return policy_.Select(frame, OpenedMap());
  };
  EXPECT_EQ(choose(kSmallViewTurnDeg + 0.1, 60), KeyFrameChoice::kNone);
  EXPECT_EQ(choose(kSmallViewTurnDeg + 0.1, 59), KeyFrameChoice::kPanorama);
  EXPECT_EQ(choose(kSmallViewTurnDeg - 0.1, 59), KeyFrameChoice::kNone);
}

TEST_F(KeyFramePolicyTest, ReturnsToSixDofModeWhereFinitePointsCoverTheImage) {
  Open();
  PolicyFrame frame = HalfCovered(2, RotatedBy(20));
  frame.finite_coverage = 0.74;
  policy_.Select(frame, OpenedMap());
  EXPECT_EQ(policy_.mode(), Mode::kPanorama);
  // This requires a pose in six degrees of freedom, whatever the coverage.
  frame.observed = ObservedMotion::kPanorama;
  frame.finite_coverage = 1;
  policy_.Select(frame, OpenedMap());
  EXPECT_EQ(policy_.mode(), Mode::kPanorama);
  for (const ObservedMotion observed : {ObservedMotion::kSixDof, ObservedMotion::kHybrid}) {
    KeyFramePolicy policy({}, kFieldOfView);
    policy.Accepted(KeyFrameChoice::kLocalizedPanorama, FromSeconds(1));
    frame.observed = observed;
    frame.finite_coverage = 0.75;
    frame.needs_six_dof = true;
    EXPECT_EQ(policy.Select(frame, OpenedMap()), KeyFrameChoice::kSixDof);
    EXPECT_EQ(policy.mode(), Mode::kSixDof);
    EXPECT_EQ(policy.OpenPanorama(OpenedMap()), kNoId);
  }
}

TEST_F(KeyFramePolicyTest, ReturnsToSixDofModeWhenTheCameraHasMovedAway) {
  Open();
  policy_.Select(HalfCovered(2, RotatedBy(20, {0, 0.99 * kParallaxDistance, 0})), OpenedMap());
  EXPECT_EQ(policy_.mode(), Mode::kPanorama);
  // Infinite points alone do not show the translation.
  policy_.Select(RotationOnly(2, RotatedBy(20, {0, 1.01 * kParallaxDistance, 0})), OpenedMap());
  EXPECT_EQ(policy_.mode(), Mode::kPanorama);
  policy_.Select(HalfCovered(2, RotatedBy(20, {0, 1.01 * kParallaxDistance, 0})), OpenedMap());
  EXPECT_EQ(policy_.mode(), Mode::kSixDof);
}

TEST_F(KeyFramePolicyTest, OpensExtendsAndReusesOnePanoramaOverARotationAndBack) {
  MapSnapshot map = PlainMap();
  std::vector<KeyFrameChoice> taken;
  double seconds = 1;
  const auto process = [&](PolicyFrame frame) {
    frame.time = FromSeconds(seconds);
    const KeyFrameChoice choice = policy_.Select(frame, map);
    if (choice != KeyFrameChoice::kNone) {
      const auto id = static_cast<KeyFrameId>(map.keyframes.size());
      if (choice == KeyFrameChoice::kLocalizedPanorama) {
        const auto panorama = static_cast<PanoramaId>(map.panoramas.size());
        map.keyframes.push_back(SixDof(id, seconds, frame.camera_from_map, panorama));
        map.panoramas.push_back({panorama, id});
      } else {
        map.keyframes.push_back(Dependent(id, seconds, frame.camera_from_map, policy_.OpenPanorama(map)));
      }
      policy_.Accepted(choice, frame.time);
      taken.push_back(choice);
    }
    seconds += 0.1;
  };
  for (double turn = 0; turn <= 10; turn += 2) process(CoveredFrame(0, RotatedBy(turn)));
  EXPECT_TRUE(taken.empty());
  for (double turn = 12; turn <= 30; turn += 2) process(HalfCovered(0, RotatedBy(turn)));
  ASSERT_EQ(taken, std::vector{KeyFrameChoice::kLocalizedPanorama});
  EXPECT_EQ(policy_.mode(), Mode::kPanorama);
  for (double turn = 32; turn <= 90; turn += 2) process(RotationOnly(0, RotatedBy(turn)));
  EXPECT_EQ(taken.size(), 5u)
      << "the reference at 16 degrees, and one every 16 degrees up to 90: 32, 48, 64 and 80";
  for (double turn = 88; turn >= 20; turn -= 2) process(RotationOnly(0, RotatedBy(turn), 0.9));
  EXPECT_EQ(taken.size(), 5u);
  process(CoveredFrame(0, RotatedBy(10)));
  EXPECT_EQ(policy_.mode(), Mode::kSixDof);
  // A second rotation in the same direction finds the closed panorama map and opens no other.
  for (double turn = 12; turn <= 30; turn += 2) {
    PolicyFrame frame = HalfCovered(0, RotatedBy(turn));
    frame.coverage = 0.9;
    process(frame);
  }
  EXPECT_EQ(map.panoramas.size(), 1u);
}

TEST_F(KeyFramePolicyTest, FindsTheOpenPanoramaInANewSnapshot) {
  Open();
  MapSnapshot map = OpenedMap();
  map.panoramas.push_back({7, 0});
  EXPECT_EQ(policy_.OpenPanorama(map), 3u);
  map.panoramas = {{7, 0}};
  EXPECT_EQ(policy_.OpenPanorama(map), kNoId);
}

// Two synchronized cameras open one each.
TEST_F(KeyFramePolicyTest, FindsItsOwnOfTwoPanoramasThatWereOpenedAtTheSameTime) {
  const auto own = testing_world::PinholeCamera(400, 300), other = testing_world::PinholeCamera(420, 320);
  MapSnapshot map = OpenedMap();
  map.keyframes.back().camera = own;
  map.keyframes.push_back(SixDof(2, 1, RotatedBy(90), 4));
  map.keyframes.back().camera = other;
  map.panoramas.push_back({4, 2});
  policy_.Accepted(KeyFrameChoice::kLocalizedPanorama, FromSeconds(1), own);
  EXPECT_EQ(policy_.OpenPanorama(map), 3u);
  policy_.Accepted(KeyFrameChoice::kLocalizedPanorama, FromSeconds(1), other);
  EXPECT_EQ(policy_.OpenPanorama(map), 4u);
  policy_.Reopen(map.panoramas.front(), map);
  EXPECT_EQ(policy_.OpenPanorama(map), 3u);
  // The calibration was estimated anew.
  policy_.Accepted(KeyFrameChoice::kLocalizedPanorama, FromSeconds(1),
                   testing_world::PinholeCamera(320, 240));
  map.panoramas.pop_back();
  EXPECT_EQ(policy_.OpenPanorama(map), 3u);
}

TEST_F(KeyFramePolicyTest, EnablesAClosedPanoramaOnlyNearItsCentreAndViewingDirection) {
  const MapSnapshot map = OpenedMap();
  const auto near = [&](const Rigid3& pose) { return policy_.PanoramaNear(pose, kPointDepth, map); };
  // The limit is half of the field of view from the viewing direction of its only keyframe, which is at 20
  // degrees.
  EXPECT_EQ(near(RotatedBy(20 + 34.9)), 3u);
  EXPECT_EQ(near(RotatedBy(20 + 35.1)), kNoId);
  EXPECT_EQ(near(RotatedBy(20 - 34.9)), 3u);
  // The limit is half of the distance at which the camera would leave it.
  EXPECT_EQ(near(RotatedBy(20, {0, 0, -0.49 * kParallaxDistance})), 3u);
  EXPECT_EQ(near(RotatedBy(20, {0, 0, -0.51 * kParallaxDistance})), kNoId);
  EXPECT_EQ(policy_.PanoramaNear(RotatedBy(20), kPointDepth, PlainMap()), kNoId);
}

TEST_F(KeyFramePolicyTest, EnablesThePanoramaWithTheNearestViewingDirection) {
  MapSnapshot map = OpenedMap();
  map.keyframes.push_back(Dependent(2, 2, RotatedBy(50), 3));
  map.keyframes.push_back(SixDof(3, 3, RotatedBy(30), 5));
  map.panoramas.push_back({5, 3});
  const auto near = [&](double degrees) {
    return policy_.PanoramaNear(RotatedBy(degrees), kPointDepth, map);
  };
  EXPECT_EQ(near(20), 3u);
  EXPECT_EQ(near(31), 5u);
  EXPECT_EQ(near(45), 3u);
}

TEST_F(KeyFramePolicyTest, ExtendsAReopenedPanorama) {
  MapSnapshot map = OpenedMap();
  policy_.Reopen(map.panoramas[0], map);
  EXPECT_EQ(policy_.mode(), Mode::kPanorama);
  EXPECT_EQ(policy_.OpenPanorama(map), 3u);
  EXPECT_EQ(policy_.Select(RotationOnly(2, RotatedBy(60)), map), KeyFrameChoice::kPanorama);
  // A panorama map whose reference is not in the map stays closed.
  KeyFramePolicy other({}, kFieldOfView);
  other.Reopen({9, 77}, map);
  EXPECT_EQ(other.mode(), Mode::kSixDof);
}

TEST_F(KeyFramePolicyTest, ResetClearsModeAndHistory) {
  Open();
  policy_.Reset();
  EXPECT_EQ(policy_.mode(), Mode::kSixDof);
  EXPECT_EQ(policy_.OpenPanorama(OpenedMap()), kNoId);
  // The pose history is cleared too, because earlier poses belong to another map.
  EXPECT_EQ(policy_.Select(CoveredFrame(1, RotatedBy(0)), PlainMap()), KeyFrameChoice::kNone);
  policy_.Reset();
  EXPECT_EQ(policy_.Select(HalfCovered(2, RotatedBy(20)), PlainMap()), KeyFrameChoice::kNone);
}

TEST_F(KeyFramePolicyTest, UsesTheGivenThresholds) {
  KeyFramePolicyOptions options;
  options.min_parallax_deg = 10;
  options.min_coverage = 0.3;
  options.min_view_ratio = 0.5;
  const MapSnapshot map = PlainMap();
  const auto choose = [&](double turn, double finite_coverage, double distance) {
    KeyFramePolicy policy(options, kFieldOfView);
    policy.Select(CoveredFrame(1, RotatedBy(0, {distance, 0, 0})), map);
    PolicyFrame frame = HalfCovered(2, RotatedBy(turn));
    frame.finite_coverage = finite_coverage;
    return policy.Select(frame, map);
  };
  const double ten = 2 * kPointDepth * std::tan(Radians(5));
  EXPECT_EQ(choose(35.1, 0.29, 0.99 * ten), KeyFrameChoice::kLocalizedPanorama);
  EXPECT_EQ(choose(34.9, 0.29, 0.99 * ten), KeyFrameChoice::kNone);
  EXPECT_EQ(choose(35.1, 0.3, 0.99 * ten), KeyFrameChoice::kNone);
  EXPECT_EQ(choose(35.1, 0.29, 1.01 * ten), KeyFrameChoice::kNone);
}

// If the mapper's queue was full or the map must not be extended here, the offered reference never appears.
TEST(KeyFramePolicy, ReturnsToSixDofModeWhenItsReferenceWasDropped) {
  KeyFramePolicy policy({}, kFieldOfView);
  MapSnapshot map;
  KeyFrame first;
  first.id = 0;
  map.keyframes = {first};
  policy.Accepted(KeyFrameChoice::kLocalizedPanorama, FromSeconds(1));
  KeyFrameChoice last = KeyFrameChoice::kNone;
  for (int i = 0; i < 300; ++i) {
    PolicyFrame frame;
    frame.time = FromSeconds(1 + i / 30.0);
    frame.camera_from_map = CameraAt({0.01 * i, 0, 0});
    frame.finite_coverage = frame.coverage = 0.6;
    frame.points = 200;
    frame.median_depth = 2;
    frame.needs_six_dof = i > 100;
    last = policy.Select(frame, map);
  }
  EXPECT_EQ(policy.mode(), KeyFramePolicy::Mode::kSixDof);
  EXPECT_EQ(last, KeyFrameChoice::kSixDof);
}

}  // namespace
}  // namespace docent::engine

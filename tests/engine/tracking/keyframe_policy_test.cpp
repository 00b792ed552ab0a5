// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/keyframe_policy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tests/engine/rendered_world.h"

// hybrid-slam Fig. 3, one transition after the other, each threshold from both sides; poses and snapshots are
// made up, there is no image anywhere.
namespace docent::engine {
namespace {

using testing_world::CameraAt;
using Mode = KeyFramePolicy::Mode;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kFieldOfView = 70 * kDegree;
constexpr double kViewTurnDeg = 14;        // 0.2 of the field of view
constexpr double kSmallViewTurnDeg = 2.1;  // 0.03 of it
constexpr double kDepth = 2;               // metres
// Two centres this far apart are seen under five degrees from a point before the middle between them.
const double kParallaxDistance = 2 * kDepth * std::tan(2.5 * kDegree);

Rigid3 TurnedBy(double degrees, const Eigen::Vector3d& center = Eigen::Vector3d::Zero()) {
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

// One keyframe at the origin that looks straight ahead.
MapSnapshot PlainMap() {
  MapSnapshot map;
  map.keyframes = {SixDof(0, 0, TurnedBy(0))};
  return map;
}
// The same, and the panorama map 3 that was opened at 1 s, with its reference at the origin, turned by 20.
MapSnapshot OpenedMap() {
  MapSnapshot map = PlainMap();
  map.keyframes.push_back(SixDof(1, 1, TurnedBy(20), 3));
  map.panoramas = {{3, 1}};
  return map;
}

// Seen well and known all over: nothing is wanted.
PolicyFrame Frame(double seconds, const Rigid3& pose) {
  PolicyFrame frame;
  frame.time = FromSeconds(seconds);
  frame.camera_from_map = pose;
  frame.points = 200;
  frame.median_depth = kDepth;
  return frame;
}
// Appearance where the map has nothing.
PolicyFrame Unknown(double seconds, const Rigid3& pose) {
  PolicyFrame frame = Frame(seconds, pose);
  frame.finite_coverage = frame.coverage = 0.5;
  return frame;
}
// Carried by infinite points alone.
PolicyFrame Turning(double seconds, const Rigid3& pose, double coverage = 0.5) {
  PolicyFrame frame = Frame(seconds, pose);
  frame.observed = ObservedMotion::kPanorama;
  frame.finite_coverage = 0;
  frame.coverage = coverage;
  return frame;
}

class KeyFrameSelecting : public ::testing::Test {
 protected:
  // What a turn from straight ahead at 1 s to this frame is answered with.
  static KeyFrameChoice AfterAStart(const PolicyFrame& frame, const MapSnapshot& map,
                                    const Rigid3& before = TurnedBy(0)) {
    KeyFramePolicy selector({}, kFieldOfView);
    EXPECT_EQ(selector.Select(Frame(1, before), map), KeyFrameChoice::kNone);
    return selector.Select(frame, map);
  }
  // Opens the panorama map of OpenedMap().
  void Open() {
    selector_.Offered(KeyFrameChoice::kLocalizedPanorama, FromSeconds(1));
    ASSERT_EQ(selector_.mode(), Mode::kPanorama);
    ASSERT_EQ(selector_.OpenPanorama(OpenedMap()), 3u);
  }

  KeyFramePolicy selector_{{}, kFieldOfView};
};

TEST_F(KeyFrameSelecting, BeginsWithGeneralMotion) {
  EXPECT_EQ(selector_.mode(), Mode::kSixDof);
  EXPECT_EQ(selector_.OpenPanorama(OpenedMap()), kNoId);
}

TEST_F(KeyFrameSelecting, PassesTheWishForAnOrdinaryKeyframeThrough) {
  PolicyFrame frame = Frame(1, TurnedBy(0, {0.4, 0, 0}));
  EXPECT_EQ(selector_.Select(frame, PlainMap()), KeyFrameChoice::kNone);
  frame.wants_six_dof = true;
  EXPECT_EQ(selector_.Select(frame, PlainMap()), KeyFrameChoice::kSixDof);
  selector_.Offered(KeyFrameChoice::kSixDof, frame.time);
  EXPECT_EQ(selector_.mode(), Mode::kSixDof);
}

TEST_F(KeyFrameSelecting, OpensAPanoramaAfterATurnOnTheSpotTowardsTheUnknown) {
  const MapSnapshot map = PlainMap();
  EXPECT_EQ(AfterAStart(Unknown(2, TurnedBy(kViewTurnDeg - 0.1)), map), KeyFrameChoice::kNone);
  EXPECT_EQ(AfterAStart(Unknown(2, TurnedBy(kViewTurnDeg + 0.1)), map), KeyFrameChoice::kLocalizedPanorama);
  EXPECT_EQ(AfterAStart(Unknown(2, TurnedBy(-kViewTurnDeg - 0.1)), map), KeyFrameChoice::kLocalizedPanorama);
  // Down, and about an axis between; but not about the viewing direction itself, which shows nothing new.
  EXPECT_EQ(AfterAStart(Unknown(2, CameraAt({0, 0, 0}, {15, 0, 0})), map),
            KeyFrameChoice::kLocalizedPanorama);
  EXPECT_EQ(AfterAStart(Unknown(2, CameraAt({0, 0, 0}, {0, 0, 60})), map), KeyFrameChoice::kNone);
}

TEST_F(KeyFrameSelecting, OpensNoneWhileTheImageIsKnown) {
  const MapSnapshot map = PlainMap();
  PolicyFrame frame = Unknown(2, TurnedBy(30));
  frame.finite_coverage = 0.75;
  EXPECT_EQ(AfterAStart(frame, map), KeyFrameChoice::kNone);
  frame.finite_coverage = 0.74;
  EXPECT_EQ(AfterAStart(frame, map), KeyFrameChoice::kLocalizedPanorama);
  // Directions of an earlier panorama map fill what finite points do not.
  frame.coverage = 0.8;
  EXPECT_EQ(AfterAStart(frame, map), KeyFrameChoice::kNone);
  frame.coverage = 0.79;
  EXPECT_EQ(AfterAStart(frame, map), KeyFrameChoice::kLocalizedPanorama);
}

TEST_F(KeyFrameSelecting, TakesAWalkForNoTurnOnTheSpot) {
  const MapSnapshot map = PlainMap();
  for (const double sign : {-1.0, 1.0}) {
    const auto from = [&](double distance) { return TurnedBy(0, {sign * distance, 0, 0}); };
    PolicyFrame frame = Unknown(2, TurnedBy(20));
    EXPECT_EQ(AfterAStart(frame, map, from(0.99 * kParallaxDistance)), KeyFrameChoice::kLocalizedPanorama);
    EXPECT_EQ(AfterAStart(frame, map, from(1.01 * kParallaxDistance)), KeyFrameChoice::kNone);
    // Twice as far from everything, the same walk is one on the spot.
    frame.median_depth = 2 * kDepth;
    EXPECT_EQ(AfterAStart(frame, map, from(1.01 * kParallaxDistance)), KeyFrameChoice::kLocalizedPanorama);
  }
}

TEST_F(KeyFrameSelecting, ForgetsTheTurnsOfLongAgo) {
  const MapSnapshot map = PlainMap();
  EXPECT_EQ(AfterAStart(Unknown(10.9, TurnedBy(20)), map), KeyFrameChoice::kLocalizedPanorama);
  // The pose of 1 s goes out of the history when that of 11.1 s comes in, and the next frame misses it.
  EXPECT_EQ(selector_.Select(Frame(1, TurnedBy(0)), map), KeyFrameChoice::kNone);
  EXPECT_EQ(selector_.Select(Frame(11.1, TurnedBy(20)), map), KeyFrameChoice::kNone);
  EXPECT_EQ(selector_.Select(Unknown(11.2, TurnedBy(20)), map), KeyFrameChoice::kNone);
}

// With parallax to every keyframe an ordinary one can be triangulated, and is the better choice (§4.2).
TEST_F(KeyFrameSelecting, PrefersAnOrdinaryKeyframeWhereThereIsParallax) {
  const auto choose = [&](double distance, MapSnapshot map) {
    PolicyFrame frame = Unknown(2, TurnedBy(20, {distance, 0, 0}));
    frame.wants_six_dof = true;
    return AfterAStart(frame, map, TurnedBy(0, {distance, 0, 0}));
  };
  EXPECT_EQ(choose(0.99 * kParallaxDistance, PlainMap()), KeyFrameChoice::kLocalizedPanorama);
  EXPECT_EQ(choose(1.01 * kParallaxDistance, PlainMap()), KeyFrameChoice::kSixDof);
  // Where a dependent keyframe of another panorama map stands is not known, so it says nothing of parallax.
  MapSnapshot map = PlainMap();
  map.keyframes.push_back(SixDof(1, 0.5, TurnedBy(90, {-3, 0, 0}), 0));
  map.keyframes.push_back(Dependent(2, 0.6, TurnedBy(90, {1.01 * kParallaxDistance, 0, 0}), 0));
  map.panoramas = {{0, 1}};
  EXPECT_EQ(choose(1.01 * kParallaxDistance, map), KeyFrameChoice::kSixDof);
}

TEST_F(KeyFrameSelecting, OpensAPanoramaAtOnceWhenThePointsRunOut) {
  PolicyFrame frame = Unknown(1, TurnedBy(0));
  frame.points = 60;
  EXPECT_EQ(selector_.Select(frame, PlainMap()), KeyFrameChoice::kNone);
  frame.points = 59;
  EXPECT_EQ(selector_.Select(frame, PlainMap()), KeyFrameChoice::kLocalizedPanorama);
  // Few points that lie all over the image are a bare wall, and an open panorama map nearby is enough.
  frame.finite_coverage = 0.75;
  EXPECT_EQ(selector_.Select(frame, PlainMap()), KeyFrameChoice::kNone);
  frame.finite_coverage = 0.5;
  EXPECT_EQ(selector_.Select(frame, OpenedMap()), KeyFrameChoice::kNone);
}

TEST_F(KeyFrameSelecting, AsksForNothingWhileAClosedPanoramaCarriesTheCamera) {
  PolicyFrame frame = Turning(2, TurnedBy(30));
  frame.wants_six_dof = true;
  EXPECT_EQ(AfterAStart(frame, OpenedMap()), KeyFrameChoice::kNone);
}

TEST_F(KeyFrameSelecting, IsInAPanoramaOnceItWasOffered) {
  for (const KeyFrameChoice choice : {KeyFrameChoice::kLocalizedPanorama, KeyFrameChoice::kFirst}) {
    KeyFramePolicy selector({}, kFieldOfView);
    selector.Offered(choice, FromSeconds(1));
    EXPECT_EQ(selector.mode(), Mode::kPanorama);
    // The mapper has yet to make it.
    EXPECT_EQ(selector.OpenPanorama(PlainMap()), kNoId);
    EXPECT_EQ(selector.Select(Turning(2, TurnedBy(60)), PlainMap()), KeyFrameChoice::kNone);
    EXPECT_EQ(selector.OpenPanorama(OpenedMap()), 3u);
    EXPECT_EQ(selector.Select(Turning(2, TurnedBy(60)), OpenedMap()), KeyFrameChoice::kPanorama);
    // A further keyframe changes nothing.
    selector.Offered(KeyFrameChoice::kPanorama, FromSeconds(2));
    EXPECT_EQ(selector.mode(), Mode::kPanorama);
    EXPECT_EQ(selector.OpenPanorama(OpenedMap()), 3u);
  }
  // A wish that was let pass opens nothing.
  EXPECT_EQ(AfterAStart(Unknown(2, TurnedBy(20)), PlainMap()), KeyFrameChoice::kLocalizedPanorama);
  EXPECT_EQ(selector_.mode(), Mode::kSixDof);
}

TEST_F(KeyFrameSelecting, AddsPanoramaKeyframesWhereThePanoramaShowsTooLittle) {
  Open();
  EXPECT_EQ(selector_.Select(Turning(2, TurnedBy(60), 0.8), OpenedMap()), KeyFrameChoice::kNone);
  EXPECT_EQ(selector_.Select(Turning(2, TurnedBy(60), 0.79), OpenedMap()), KeyFrameChoice::kPanorama);
}

TEST_F(KeyFrameSelecting, AddsPanoramaKeyframesOnlyWhereNoneLooksThatWay) {
  Open();
  MapSnapshot map = OpenedMap();
  const auto at = [&](double degrees) { return selector_.Select(Turning(2, TurnedBy(degrees)), map); };
  EXPECT_EQ(at(20 + kViewTurnDeg - 0.1), KeyFrameChoice::kNone);
  EXPECT_EQ(at(20 + kViewTurnDeg + 0.1), KeyFrameChoice::kPanorama);
  EXPECT_EQ(at(20 - kViewTurnDeg - 0.1), KeyFrameChoice::kPanorama);
  map.keyframes.push_back(Dependent(2, 2, TurnedBy(40), 3));
  EXPECT_EQ(at(40), KeyFrameChoice::kNone);
  EXPECT_EQ(at(40 + kViewTurnDeg + 0.1), KeyFrameChoice::kPanorama);
  // One of another panorama map sees other directions, and does not count; nor does an ordinary one.
  map.keyframes.push_back(SixDof(3, 3, TurnedBy(80), 4));
  map.keyframes.push_back(SixDof(4, 4, TurnedBy(80)));
  map.panoramas.push_back({4, 3});
  EXPECT_EQ(at(80), KeyFrameChoice::kPanorama);
}

TEST_F(KeyFrameSelecting, AddsPanoramaKeyframesSoonerWhenThePointsRunOut) {
  Open();
  const auto choose = [&](double degrees, int points) {
    PolicyFrame frame = Turning(2, TurnedBy(20 + degrees));
    frame.points = points;
    return selector_.Select(frame, OpenedMap());
  };
  EXPECT_EQ(choose(kSmallViewTurnDeg + 0.1, 60), KeyFrameChoice::kNone);
  EXPECT_EQ(choose(kSmallViewTurnDeg + 0.1, 59), KeyFrameChoice::kPanorama);
  EXPECT_EQ(choose(kSmallViewTurnDeg - 0.1, 59), KeyFrameChoice::kNone);
}

TEST_F(KeyFrameSelecting, ReturnsToGeneralMotionWhereTheMapIsWellSeen) {
  Open();
  PolicyFrame frame = Unknown(2, TurnedBy(20));
  frame.finite_coverage = 0.74;
  selector_.Select(frame, OpenedMap());
  EXPECT_EQ(selector_.mode(), Mode::kPanorama);
  // Only a pose in all six degrees of freedom returns, however much is covered.
  frame.observed = ObservedMotion::kPanorama;
  frame.finite_coverage = 1;
  selector_.Select(frame, OpenedMap());
  EXPECT_EQ(selector_.mode(), Mode::kPanorama);
  for (const ObservedMotion observed : {ObservedMotion::kSixDof, ObservedMotion::kHybrid}) {
    KeyFramePolicy selector({}, kFieldOfView);
    selector.Offered(KeyFrameChoice::kLocalizedPanorama, FromSeconds(1));
    frame.observed = observed;
    frame.finite_coverage = 0.75;
    frame.wants_six_dof = true;
    EXPECT_EQ(selector.Select(frame, OpenedMap()), KeyFrameChoice::kSixDof);
    EXPECT_EQ(selector.mode(), Mode::kSixDof);
    EXPECT_EQ(selector.OpenPanorama(OpenedMap()), kNoId);
  }
}

TEST_F(KeyFrameSelecting, ReturnsToGeneralMotionWhenTheCameraHasMovedAway) {
  Open();
  selector_.Select(Unknown(2, TurnedBy(20, {0, 0.99 * kParallaxDistance, 0})), OpenedMap());
  EXPECT_EQ(selector_.mode(), Mode::kPanorama);
  // By rays alone nobody knows that it has.
  selector_.Select(Turning(2, TurnedBy(20, {0, 1.01 * kParallaxDistance, 0})), OpenedMap());
  EXPECT_EQ(selector_.mode(), Mode::kPanorama);
  selector_.Select(Unknown(2, TurnedBy(20, {0, 1.01 * kParallaxDistance, 0})), OpenedMap());
  EXPECT_EQ(selector_.mode(), Mode::kSixDof);
}

TEST_F(KeyFrameSelecting, GoesTheWholeRoundOfATurnAndBack) {
  MapSnapshot map = PlainMap();
  std::vector<KeyFrameChoice> taken;
  double seconds = 1;
  const auto see = [&](PolicyFrame frame) {
    frame.time = FromSeconds(seconds);
    const KeyFrameChoice choice = selector_.Select(frame, map);
    if (choice != KeyFrameChoice::kNone) {
      const auto id = static_cast<KeyFrameId>(map.keyframes.size());
      if (choice == KeyFrameChoice::kLocalizedPanorama) {
        const auto panorama = static_cast<PanoramaId>(map.panoramas.size());
        map.keyframes.push_back(SixDof(id, seconds, frame.camera_from_map, panorama));
        map.panoramas.push_back({panorama, id});
      } else {
        map.keyframes.push_back(Dependent(id, seconds, frame.camera_from_map, selector_.OpenPanorama(map)));
      }
      selector_.Offered(choice, frame.time);
      taken.push_back(choice);
    }
    seconds += 0.1;
  };
  for (double turn = 0; turn <= 10; turn += 2) see(Frame(0, TurnedBy(turn)));
  EXPECT_TRUE(taken.empty());
  for (double turn = 12; turn <= 30; turn += 2) see(Unknown(0, TurnedBy(turn)));
  ASSERT_EQ(taken, std::vector{KeyFrameChoice::kLocalizedPanorama});
  EXPECT_EQ(selector_.mode(), Mode::kPanorama);
  for (double turn = 32; turn <= 90; turn += 2) see(Turning(0, TurnedBy(turn)));
  EXPECT_EQ(taken.size(), 5u) << "one every 16 degrees from the reference's 16 to 90: 32, 48, 64 and 80";
  for (double turn = 88; turn >= 20; turn -= 2) see(Turning(0, TurnedBy(turn), 0.9));
  EXPECT_EQ(taken.size(), 5u);
  see(Frame(0, TurnedBy(10)));
  EXPECT_EQ(selector_.mode(), Mode::kSixDof);
  // A second turn the same way finds the closed panorama map and opens no other.
  for (double turn = 12; turn <= 30; turn += 2) {
    PolicyFrame frame = Unknown(0, TurnedBy(turn));
    frame.coverage = 0.9;
    see(frame);
  }
  EXPECT_EQ(map.panoramas.size(), 1u);
}

TEST_F(KeyFrameSelecting, KnowsTheOpenPanoramaByItsReferenceThoughTheMapIsAnotherSnapshot) {
  Open();
  MapSnapshot map = OpenedMap();
  map.panoramas.push_back({7, 0});
  EXPECT_EQ(selector_.OpenPanorama(map), 3u);
  map.panoramas = {{7, 0}};
  EXPECT_EQ(selector_.OpenPanorama(map), kNoId);
}

TEST_F(KeyFrameSelecting, EnablesAClosedPanoramaOnlyAtItsCentreAndLookingItsWay) {
  const MapSnapshot map = OpenedMap();
  const auto near = [&](const Rigid3& pose) { return selector_.PanoramaNear(pose, kDepth, map); };
  // Half of the field of view from the viewing direction, 20 degrees, of its only keyframe.
  EXPECT_EQ(near(TurnedBy(20 + 34.9)), 3u);
  EXPECT_EQ(near(TurnedBy(20 + 35.1)), kNoId);
  EXPECT_EQ(near(TurnedBy(20 - 34.9)), 3u);
  // Half of the distance at which it would be left.
  EXPECT_EQ(near(TurnedBy(20, {0, 0, -0.49 * kParallaxDistance})), 3u);
  EXPECT_EQ(near(TurnedBy(20, {0, 0, -0.51 * kParallaxDistance})), kNoId);
  EXPECT_EQ(selector_.PanoramaNear(TurnedBy(20), kDepth, PlainMap()), kNoId);
}

TEST_F(KeyFrameSelecting, EnablesThePanoramaWhoseKeyframeLooksMostThatWay) {
  MapSnapshot map = OpenedMap();
  map.keyframes.push_back(Dependent(2, 2, TurnedBy(50), 3));
  map.keyframes.push_back(SixDof(3, 3, TurnedBy(30), 5));
  map.panoramas.push_back({5, 3});
  const auto near = [&](double degrees) { return selector_.PanoramaNear(TurnedBy(degrees), kDepth, map); };
  EXPECT_EQ(near(20), 3u);
  EXPECT_EQ(near(31), 5u);
  EXPECT_EQ(near(45), 3u);
}

TEST_F(KeyFrameSelecting, ExtendsAPanoramaThatIsOpenedAgain) {
  MapSnapshot map = OpenedMap();
  selector_.Reopen(map.panoramas[0], map);
  EXPECT_EQ(selector_.mode(), Mode::kPanorama);
  EXPECT_EQ(selector_.OpenPanorama(map), 3u);
  EXPECT_EQ(selector_.Select(Turning(2, TurnedBy(60)), map), KeyFrameChoice::kPanorama);
  // One whose reference is not in the map stays closed.
  KeyFramePolicy other({}, kFieldOfView);
  other.Reopen({9, 77}, map);
  EXPECT_EQ(other.mode(), Mode::kSixDof);
}

TEST_F(KeyFrameSelecting, ForgetsAllWhenItIsReset) {
  Open();
  selector_.Reset();
  EXPECT_EQ(selector_.mode(), Mode::kSixDof);
  EXPECT_EQ(selector_.OpenPanorama(OpenedMap()), kNoId);
  // The poses too: what came before was in another map.
  EXPECT_EQ(selector_.Select(Frame(1, TurnedBy(0)), PlainMap()), KeyFrameChoice::kNone);
  selector_.Reset();
  EXPECT_EQ(selector_.Select(Unknown(2, TurnedBy(20)), PlainMap()), KeyFrameChoice::kNone);
}

TEST_F(KeyFrameSelecting, HoldsToTheThresholdsItWasGiven) {
  KeyFramePolicyOptions options;
  options.min_parallax_deg = 10;
  options.min_coverage = 0.3;
  options.min_view_ratio = 0.5;
  const MapSnapshot map = PlainMap();
  const auto choose = [&](double turn, double finite_coverage, double distance) {
    KeyFramePolicy selector(options, kFieldOfView);
    selector.Select(Frame(1, TurnedBy(0, {distance, 0, 0})), map);
    PolicyFrame frame = Unknown(2, TurnedBy(turn));
    frame.finite_coverage = finite_coverage;
    return selector.Select(frame, map);
  };
  const double ten = 2 * kDepth * std::tan(5 * kDegree);
  EXPECT_EQ(choose(35.1, 0.29, 0.99 * ten), KeyFrameChoice::kLocalizedPanorama);
  EXPECT_EQ(choose(34.9, 0.29, 0.99 * ten), KeyFrameChoice::kNone);
  EXPECT_EQ(choose(35.1, 0.3, 0.99 * ten), KeyFrameChoice::kNone);
  EXPECT_EQ(choose(35.1, 0.29, 1.01 * ten), KeyFrameChoice::kNone);
}

// The mapper's queue was full, or the map may not grow here: the reference that was offered never comes.
TEST(KeyFramePolicy, ReturnsToGeneralMotionWhenItsReferenceWasDropped) {
  KeyFramePolicy selector({}, 70 * std::numbers::pi / 180);
  MapSnapshot map;
  KeyFrame first;
  first.id = 0;
  map.keyframes = {first};
  selector.Offered(KeyFrameChoice::kLocalizedPanorama, FromSeconds(1));
  KeyFrameChoice last = KeyFrameChoice::kNone;
  for (int i = 0; i < 300; ++i) {
    PolicyFrame frame;
    frame.time = FromSeconds(1 + i / 30.0);
    frame.camera_from_map = CameraAt({0.01 * i, 0, 0});
    frame.finite_coverage = frame.coverage = 0.6;
    frame.points = 200;
    frame.median_depth = 2;
    frame.wants_six_dof = i > 100;
    last = selector.Select(frame, map);
  }
  EXPECT_EQ(selector.mode(), KeyFramePolicy::Mode::kSixDof);
  EXPECT_EQ(last, KeyFrameChoice::kSixDof);
}

}  // namespace
}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#include "engine/system/map_policy.h"

#include <gtest/gtest.h>

#include <memory>
#include <variant>

#include "tests/engine/mapping/panorama/panorama_scene.h"

namespace docent::engine {
namespace {

using Order = MapAssignment::Order;

std::shared_ptr<const MapSnapshot> MapWithAPoint() {
  auto map = std::make_shared<MapSnapshot>();
  map->points.emplace_back();
  return map;
}

std::shared_ptr<const MapSnapshot> MapWithoutDepth() {
  Map map;
  map.AddKeyFrame(testing_world::BlankKeyFrame());
  map.OpenPanorama(0);
  return map.Snapshot();
}

// Two cameras of one wearer, without images: the tests say what the trackers find.
class PolicyForTwoCameras : public ::testing::Test {
 protected:
  PolicyForTwoCameras() {
    state_.cameras.resize(2);
    for (SystemCamera& camera : state_.cameras)
      camera.calibration_monitor = std::make_unique<CalibrationMonitor>(testing_world::Camera());
  }

  MapAssignment& Assignment(std::size_t camera) { return state_.cameras[camera].assignment; }
  KnownMap& MapOf(std::uint64_t key) { return state_.maps.at(key); }
  // The order that the camera receives with its next frame.
  Order NextOrder(std::size_t camera) {
    const KnownMap* const map = state_.FindMap(Assignment(camera).map());
    return Assignment(camera).TakeOrder(map != nullptr && map->snapshot && map->snapshot->HasFinitePoints());
  }
  // A frame of the camera ends in this state, and in this map if it has a pose.
  TrackedFrame Handle(std::size_t camera, double seconds, TrackingState state, std::uint64_t map = 0,
                      bool left_map = false) {
    TrackedFrame frame;
    frame.frame.time = FromSeconds(seconds);
    frame.state = state;
    frame.map_key = map;
    frame.left_map = left_map;
    policy_.HandleResult(camera, &frame);
    return frame;
  }
  // The camera is lost in its map at this time, and starts the next one after that.
  void StartMapAfterLoss(std::size_t camera, double seconds) {
    for (const double later : {0.0, 0.25}) Lose(camera, seconds + later);
    for (const std::size_t each : {0, 1}) NextOrder(each);
  }
  void Lose(std::size_t camera, double seconds) { Handle(camera, seconds, TrackingState::kLost); }
  // A camera started map 1, both are in it, and lost since this time.
  void LoseMapWithAPoint(double seconds) {
    policy_.StartMap(1, 0, false);
    for (const std::size_t camera : {0, 1}) NextOrder(camera);
    MapOf(1).SetSnapshot(MapWithAPoint());
    for (const std::size_t camera : {0, 1}) Lose(camera, seconds);
  }
  // After the loss of map 1, camera 0 starts map 2, and is lost before it has depth.
  void LoseTheMapAfterALoss() {
    LoseMapWithAPoint(2);
    Lose(0, 2.25);
    for (const std::size_t camera : {0, 1}) NextOrder(camera);
    MapOf(2).SetSnapshot(MapWithoutDepth());
    Handle(0, 2.3, TrackingState::kPanorama, 2);
    Lose(0, 2.4);
    Lose(0, 2.6);
  }
  // The application adds a panorama map, and both cameras search it.
  void EnterMapWithoutDepth(std::uint64_t key) {
    state_.AddMap(key).SetSnapshot(MapWithoutDepth());
    policy_.EnterMap(key, 0);
    for (const std::size_t camera : {0, 1}) EXPECT_EQ(NextOrder(camera), Order::kEnter);
  }

  SystemOptions options_;
  SystemState state_{2};
  CameraCalibrations calibrations_{&state_};
  PlaceIndex index_;
  MappingThread mapping_{MapperOptions(), /*threaded=*/false, [](const MappingThread::MapperUpdate&) {}};
  MapPolicy policy_{options_, &state_, &calibrations_, &index_, &mapping_};
};

TEST_F(PolicyForTwoCameras, LetsOneTrackedCameraGiveDepthToAMapThatWasEntered) {
  EnterMapWithoutDepth(1);
  Handle(0, 1.0, TrackingState::kPanorama, 1);
  EXPECT_EQ(NextOrder(0), Order::kGiveDepth);
  Handle(1, 1.0, TrackingState::kPanorama, 1);
  EXPECT_EQ(NextOrder(1), Order::kNone) << "the other camera does";
  Handle(0, 1.1, TrackingState::kPanorama, 1);
  EXPECT_EQ(NextOrder(0), Order::kNone) << "it does so already";
  policy_.Disconnect(0);
  Handle(1, 1.2, TrackingState::kPanorama, 1);
  EXPECT_EQ(NextOrder(1), Order::kGiveDepth);
  EXPECT_EQ(NextOrder(0), Order::kEnter) << "when it is back";
}

TEST_F(PolicyForTwoCameras, GivesNoDepthToAMapThatMayNotBeExtended) {
  EnterMapWithoutDepth(1);
  MapOf(1).permissions.extend = false;
  Handle(0, 1.0, TrackingState::kPanorama, 1);
  EXPECT_EQ(NextOrder(0), Order::kNone);
}

TEST_F(PolicyForTwoCameras, ReplacesAMapWithoutDepthThatACameraStarted) {
  policy_.StartMap(1, 1, false);
  for (const std::size_t camera : {0, 1}) NextOrder(camera);
  MapOf(1).SetSnapshot(MapWithoutDepth());
  Lose(0, 2);
  Lose(0, 2.2);
  EXPECT_TRUE(MapOf(1).discarded);
  EXPECT_EQ(state_.active_key, 2u);
  EXPECT_EQ(NextOrder(0), Order::kEnter);
  EXPECT_EQ(NextOrder(1), Order::kStart);
}

TEST_F(PolicyForTwoCameras, LetsTheLostCameraStartAReplacementOfTheMapOfADisconnectedCamera) {
  policy_.StartMap(1, 0, false);
  for (const std::size_t camera : {0, 1}) NextOrder(camera);
  MapOf(1).SetSnapshot(MapWithoutDepth());
  state_.cameras[0].is_connected = false;
  Lose(1, 2);
  Lose(1, 2.2);
  EXPECT_TRUE(MapOf(1).discarded);
  EXPECT_EQ(NextOrder(0), Order::kEnter);
  EXPECT_EQ(NextOrder(1), Order::kStart);
}

TEST_F(PolicyForTwoCameras, CountsNoLossWhileTheOtherCameraIsTracked) {
  policy_.StartMap(1, 0, false);
  for (const std::size_t camera : {0, 1}) NextOrder(camera);
  MapOf(1).SetSnapshot(MapWithoutDepth());
  Handle(0, 1.0, TrackingState::kPanorama, 1);
  for (const double seconds : {1.0, 2.0}) Lose(1, seconds);  // It looks elsewhere.
  Handle(0, 2.0, TrackingState::kPanorama, 1);
  Lose(0, 2.03);
  Lose(1, 2.04);
  EXPECT_TRUE(MapOf(1).Exists()) << "both are lost for 10 ms only";
  EXPECT_EQ(Assignment(0).map(), 1u);
  Lose(1, 2.3);
  EXPECT_FALSE(MapOf(1).Exists());
}

TEST_F(PolicyForTwoCameras, StartsNoMapForACameraThatLooksElsewhereWhenTheOtherMissesAnImage) {
  options_.new_map_when_lost = true;
  LoseMapWithAPoint(0.5);
  Handle(0, 0.6, TrackingState::kSixDof, 1);
  for (const double seconds : {1.0, 5.0, 9.0}) {
    Handle(0, seconds, TrackingState::kSixDof, 1);
    Lose(1, seconds);
  }
  Lose(0, 9.03);
  Lose(1, 9.04);
  EXPECT_EQ(state_.active_key, 1u);
}

TEST_F(PolicyForTwoCameras, LetsTheOtherCameraStartTheMapOfADisconnectedOne) {
  policy_.StartMap(1, 0, false);
  for (const std::size_t camera : {0, 1}) NextOrder(camera);
  Handle(1, 1, TrackingState::kInitializing);
  policy_.Disconnect(0);
  Handle(1, 1.03, TrackingState::kInitializing);
  EXPECT_EQ(NextOrder(1), Order::kStart);
  EXPECT_EQ(NextOrder(0), Order::kEnter);
  policy_.Disconnect(1);  // Nobody is left to start it.
  EXPECT_EQ(NextOrder(0), Order::kNone);
}

TEST_F(PolicyForTwoCameras, LeavesAMapThatADisconnectedCameraHasStarted) {
  policy_.StartMap(1, 0, false);
  for (const std::size_t camera : {0, 1}) NextOrder(camera);
  MapOf(1).SetSnapshot(MapWithAPoint());
  policy_.Disconnect(0);
  EXPECT_EQ(NextOrder(1), Order::kNone);
}

TEST_F(PolicyForTwoCameras, DoesNotCountADisconnectedCameraAsTrackedInTheMapThatItStarted) {
  policy_.StartMap(1, 0, false);
  for (const std::size_t camera : {0, 1}) NextOrder(camera);
  MapOf(1).SetSnapshot(MapWithoutDepth());
  policy_.Disconnect(0);
  policy_.HandleMapperEvent({FromSeconds(1), MapperEvent::MapStarted{}}, &MapOf(1));
  EXPECT_FALSE(state_.association.IsTracked(0));
  EXPECT_EQ(state_.association.SearchedMap(), 0u) << "the map has begun";
}

TEST_F(PolicyForTwoCameras, DoesNotLetADisconnectedCameraStartAMapThatTheOtherOneStarts) {
  policy_.StartMap(1, 0, false);
  for (const std::size_t camera : {0, 1}) NextOrder(camera);
  policy_.Disconnect(0);  // It has given an initial pair.
  policy_.HandleMapperEvent({FromSeconds(1), MapperEvent::StartFailed{}}, &MapOf(1));
  EXPECT_EQ(NextOrder(0), Order::kEnter);
  EXPECT_EQ(NextOrder(1), Order::kStart);
}

TEST_F(PolicyForTwoCameras, LetsACameraThatReturnsStartTheMapThatNobodyElseStarts) {
  policy_.StartMap(1, 0, false);
  for (const std::size_t camera : {0, 1}) NextOrder(camera);
  for (const std::size_t camera : {1, 0}) policy_.Disconnect(camera);
  policy_.HandleMapperEvent({FromSeconds(1), MapperEvent::StartFailed{}}, &MapOf(1));
  EXPECT_EQ(NextOrder(0), Order::kStart);
}

TEST_F(PolicyForTwoCameras, KeepsAMapWithoutDepthThatNoCameraStarted) {
  EnterMapWithoutDepth(1);
  for (const double seconds : {2.0, 2.2, 9.0}) Lose(0, seconds);
  EXPECT_TRUE(MapOf(1).Exists());
  EXPECT_EQ(state_.maps.size(), 1u);
  EXPECT_EQ(state_.association.SearchedMap(), 0u) << "the cameras may search every map";
}

TEST_F(PolicyForTwoCameras, KeepsAMapWithoutDepthThatMayNotBeDiscarded) {
  policy_.StartMap(1, 0, false);
  for (const std::size_t camera : {0, 1}) NextOrder(camera);
  MapOf(1).SetSnapshot(MapWithoutDepth());
  MapOf(1).permissions.discard = false;
  for (const double seconds : {2.0, 2.2, 9.0}) Lose(0, seconds);
  EXPECT_TRUE(MapOf(1).Exists());
}

TEST_F(PolicyForTwoCameras, LetsTheLostCameraStartAReplacementThatNoOtherStarts) {
  EnterMapWithoutDepth(1);
  MapOf(1).started_here = true;
  Lose(1, 2);
  Lose(1, 2.2);
  EXPECT_TRUE(MapOf(1).discarded);
  EXPECT_EQ(NextOrder(0), Order::kEnter);
  EXPECT_EQ(NextOrder(1), Order::kStart);
}

TEST_F(PolicyForTwoCameras, StartsOneMapAfterALossWhileTheOtherCameraProcessesAFrame) {
  options_.new_map_when_lost = true;
  LoseMapWithAPoint(2);
  Lose(0, 2.25);
  ASSERT_EQ(state_.active_key, 2u);
  Lose(1, 2.26);  // in the first map
  EXPECT_FALSE(Assignment(1).lost_since());
  EXPECT_EQ(NextOrder(0), Order::kStartAfterLoss);
  EXPECT_EQ(NextOrder(1), Order::kEnter);
  for (const double seconds : {2.3, 2.5, 2.9}) {
    for (const std::size_t camera : {0, 1}) Handle(camera, seconds, TrackingState::kInitializing);
  }
  EXPECT_EQ(state_.active_key, 2u);
}

TEST_F(PolicyForTwoCameras, LetsTheCameraThatWaitsForAMapAfterALossReturnToTheKnownOne) {
  options_.new_map_when_lost = true;
  LoseMapWithAPoint(2);
  Lose(0, 2.25);
  ASSERT_EQ(state_.active_key, 2u);
  for (const std::size_t camera : {0, 1}) NextOrder(camera);
  EXPECT_EQ(state_.association.SearchedMap(1), 0u);
  Handle(0, 2.4, TrackingState::kInitializing);
  EXPECT_EQ(Handle(1, 2.4, TrackingState::kRelocalized, 1).state, TrackingState::kRelocalized);
  EXPECT_EQ(Assignment(1).map(), 1u);
  EXPECT_EQ(Assignment(0).map(), 1u);
  EXPECT_TRUE(MapOf(2).discarded);
  EXPECT_EQ(state_.active_key, 1u);
}

TEST_F(PolicyForTwoCameras, SearchesTheKnownMapsWhileAMapAfterALossIsReplaced) {
  options_.new_map_when_lost = true;
  LoseTheMapAfterALoss();
  ASSERT_TRUE(MapOf(2).discarded);
  EXPECT_EQ(state_.association.SearchedMap(1), 0u);
}

TEST_F(PolicyForTwoCameras, SearchesNoKnownMapWhileAMapBeginsThatAPersonAskedFor) {
  LoseMapWithAPoint(2);
  policy_.StartMap(5, 0, false);
  EXPECT_EQ(state_.association.SearchedMap(1), 5u);
}

TEST_F(PolicyForTwoCameras, KeepsAMapThatWasOrderedWhileTheCameraLeftTheLastOne) {
  options_.new_map_when_lost = true;
  LoseMapWithAPoint(2);
  policy_.StartMap(5, 0, false);
  Handle(0, 2.1, TrackingState::kLost, /*map=*/0, /*left_map=*/true);
  EXPECT_EQ(state_.active_key, 5u);
  EXPECT_EQ(NextOrder(0), Order::kStart);
}

TEST_F(PolicyForTwoCameras, DoesNotCountARejectedPoseAsALossInTheMapThatWasOrdered) {
  LoseMapWithAPoint(2);
  policy_.StartMap(5, 0, false);
  EXPECT_EQ(Handle(1, 2.1, TrackingState::kSixDof, 1).state, TrackingState::kLost);
  EXPECT_FALSE(Assignment(1).lost_since());
}

TEST_F(PolicyForTwoCameras, ForgetsAMapOnlyIfItWasNeverInitialized) {
  policy_.StartMap(1, 0, false);
  policy_.LeaveMap(1);
  EXPECT_FALSE(state_.maps.contains(1));
  policy_.StartMap(2, 0, false);
  MapOf(2).SetSnapshot(MapWithoutDepth());
  MapOf(2).SetSnapshot(nullptr);  // no longer in memory
  policy_.LeaveMap(2);
  EXPECT_TRUE(state_.maps.contains(2));
}

TEST_F(PolicyForTwoCameras, SearchesInitialViewsAgainThatTheMapperDrops) {
  policy_.StartMap(1, 0, false);
  for (const std::size_t camera : {0, 1}) NextOrder(camera);
  policy_.Activate(MapOf(1));
  EXPECT_EQ(NextOrder(0), Order::kStart);
  EXPECT_EQ(NextOrder(1), Order::kNone) << "it waits for the map";
  MapOf(1).SetSnapshot(MapWithoutDepth());
  policy_.EnterMap(1, 0);  // which is the current one
  EXPECT_EQ(NextOrder(0), Order::kStartAgain) << "the panorama map stays";
  MapOf(1).permissions.extend = false;
  policy_.Activate(MapOf(1));
  MapOf(1).permissions.extend = true;
  policy_.Activate(MapOf(1));
  EXPECT_EQ(NextOrder(0), Order::kStartAgain) << "its policy was changed";
}

TEST_F(PolicyForTwoCameras, TracksAMapThatTheMapperHasMadeOfTheInitialViews) {
  policy_.StartMap(1, 0, false);
  for (const std::size_t camera : {0, 1}) NextOrder(camera);
  MapOf(1).SetSnapshot(MapWithAPoint());
  policy_.Activate(MapOf(1));
  EXPECT_EQ(NextOrder(0), Order::kNone);
}

TEST_F(PolicyForTwoCameras, KeepsNoSnapshotOfADiscardedMap) {
  options_.new_map_when_lost = true;
  LoseTheMapAfterALoss();
  ASSERT_TRUE(MapOf(2).discarded) << "the camera was lost before it had depth";
  EXPECT_FALSE(MapOf(2).snapshot);
  for (const std::size_t camera : {0, 1}) NextOrder(camera);
  MapOf(3).SetSnapshot(MapWithoutDepth());
  Handle(0, 2.7, TrackingState::kPanorama, 3);
  Handle(0, 2.8, TrackingState::kRelocalized, 1);
  ASSERT_TRUE(MapOf(3).discarded) << "the camera is back in the first map";
  EXPECT_FALSE(MapOf(3).snapshot);
  EXPECT_TRUE(MapOf(1).snapshot);
}

TEST_F(PolicyForTwoCameras, KeepsAMapThatMayNotBeDiscardedWhenTheCameraIsFoundInAnother) {
  options_.new_map_when_lost = true;
  LoseMapWithAPoint(2);
  Lose(0, 2.25);
  for (const std::size_t camera : {0, 1}) NextOrder(camera);
  MapOf(2).SetSnapshot(MapWithoutDepth());
  MapOf(2).permissions.discard = false;
  Handle(0, 2.3, TrackingState::kPanorama, 2);
  Handle(0, 2.4, TrackingState::kRelocalized, 1);
  EXPECT_EQ(Assignment(0).map(), 1u);
  EXPECT_TRUE(MapOf(2).Exists());
  EXPECT_TRUE(MapOf(2).snapshot);
}

TEST_F(PolicyForTwoCameras, KeepsNoSnapshotOfAMapThatWasJoinedIntoAnother) {
  LoseMapWithAPoint(2);
  state_.AddMap(2).SetSnapshot(MapWithAPoint());
  policy_.joins().Request(&MapOf(2), MapOf(1));
  MapJoinAttempt attempt;
  attempt.joined = std::make_shared<const JoinedMap>();
  policy_.joins().Handle(attempt, &MapOf(1));
  EXPECT_EQ(MapOf(2).joined_into, 1u);
  EXPECT_FALSE(MapOf(2).snapshot);
}

TEST_F(PolicyForTwoCameras, JoinsAllMapsThatWereStartedAfterLossesWithTheOneThatTheCameraReturnsTo) {
  options_.new_map_when_lost = true;
  LoseMapWithAPoint(2);
  for (const std::uint64_t key : {2, 3, 4}) {
    StartMapAfterLoss(0, static_cast<double>(key));
    ASSERT_EQ(state_.active_key, key);
    MapOf(key).SetSnapshot(MapWithAPoint());
  }
  MapOf(3).permissions.join = false;
  Handle(0, 5, TrackingState::kRelocalized, 1);
  EXPECT_EQ(MapOf(4).join_with, 1u);
  EXPECT_EQ(MapOf(3).join_with, 0u) << "it may not be joined";
  EXPECT_EQ(MapOf(2).join_with, 1u);
  EXPECT_EQ(MapOf(1).join_with, 0u);
}

TEST_F(PolicyForTwoCameras, AnswersARequestToJoinAMapThatWasRemovedMeanwhile) {
  LoseMapWithAPoint(2);
  state_.AddMap(2).SetSnapshot(MapWithAPoint());
  policy_.joins().Request(&MapOf(2), MapOf(1));
  MapOf(2).Discard();
  policy_.joins().Handle(MapJoinAttempt(), &MapOf(1));
  EXPECT_TRUE(std::holds_alternative<JoinRefused>(state_.events.back().what));
}

TEST_F(PolicyForTwoCameras, StartsAMapWithOneCameraAlthoughItIsActivatedAtOnce) {
  policy_.StartMap(1, 0, false);
  for (const std::size_t camera : {0, 1}) NextOrder(camera);
  MapOf(1).permissions.extend = false;
  policy_.Activate(MapOf(1));
  policy_.StartMap(2, 1, false);
  policy_.Activate(MapOf(2));
  EXPECT_EQ(NextOrder(0), Order::kEnter);
  EXPECT_EQ(NextOrder(1), Order::kStart);
}

}  // namespace
}  // namespace docent::engine

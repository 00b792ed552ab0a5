// SPDX-License-Identifier: Apache-2.0
#include "app/session/session_state.h"

#include <gmock/gmock.h>

#include <memory>
#include <utility>

#include "content/edits.h"
#include "engine/base/error.h"
#include "maps/library/library.h"

namespace docent::app {
namespace {

std::shared_ptr<const content::Scene> SignpostScene(std::uint64_t key, const std::string& map) {
  content::Entity sign;
  sign.kind = content::Entity::Kind::kSignpost;
  sign.name = "sign-1";
  sign.signpost.to_key = key;
  sign.signpost.to_map = map;
  content::Scene scene;
  scene.entities = {sign};
  return std::make_shared<content::Scene>(scene);
}

const content::Signpost& SignpostIn(SessionState& state, std::uint64_t key) {
  return state.FindMap(key)->scene->entities.front().signpost;
}

TEST(SessionState, ContinuesTheNumberOfAMapName) {
  SessionState state({});
  EXPECT_EQ(state.FreeMapName("Hall"), "Hall 2");
  EXPECT_EQ(state.FreeMapName("Hall 2"), "Hall 2");
  state.AddMap(1, "Hall 2");
  EXPECT_EQ(state.FreeMapName("Hall"), "Hall 3");
  EXPECT_EQ(state.FreeMapName("Hall 2"), "Hall 3");
  EXPECT_EQ(state.FreeMapName("Room A4"), "Room A4 2");
}

TEST(SessionState, GivesNoMapANameThatALibraryRefuses) {
  const SessionState state({});
  std::string cyrillic;
  for (int i = 0; i < 100; ++i) cyrillic += "\xD0\x97";
  for (const std::string& longest : {std::string(200, 'x'), cyrillic}) {
    ASSERT_EQ(maps::ValidateMapName(longest), "");
    EXPECT_EQ(maps::ValidateMapName(state.FreeMapName(longest)), "");
    EXPECT_THAT(state.FreeMapName(longest), testing::EndsWith(" 2"));
  }
}

TEST(SessionState, FreesTheNameOfAMapThatWasDiscarded) {
  SessionState state({});
  state.AddMap(1, "Hall 2").discarded = true;
  EXPECT_EQ(state.FreeMapName("Hall"), "Hall 2");
  EXPECT_EQ(state.FindByName("Hall 2"), nullptr);
  EXPECT_EQ(state.NameOf(1), "Hall 2");  // what was said about it still has a name
}

TEST(SessionState, KeepsTheNumbersOfADiscardedMapAndNotItsImages) {
  SessionMap map;
  auto image = std::make_shared<const engine::ImageFeatures>();
  const std::weak_ptr<const engine::ImageFeatures> watched = image;
  auto snapshot = std::make_shared<engine::MapSnapshot>();
  snapshot->keyframes.emplace_back().features = std::move(image);
  map.snapshot = map.saved_snapshot = std::move(snapshot);
  map.Discard();
  EXPECT_FALSE(map.Exists());
  EXPECT_EQ(map.snapshot->keyframes.size(), 1u);
  EXPECT_TRUE(watched.expired());
}

TEST(SessionState, KeepsTheNameOfAMapThatWasJoined) {
  SessionState state({});
  state.AddMap(1, "Hall");
  state.AddMap(2, "Hall 2").joined_into = 1;
  EXPECT_EQ(state.FreeMapName("Hall"), "Hall 3");
  EXPECT_EQ(state.FindByName("Hall 2"), nullptr);
}

TEST(SessionState, RefusesAMapThatIsNotInitialized) {
  SessionState state({});
  EXPECT_THROW(state.InitializedMap("Hall"), Error);
  SessionMap& map = state.AddMap(1, "Hall");
  EXPECT_THROW(state.InitializedMap("Hall"), Error);
  map.snapshot = std::make_shared<engine::MapSnapshot>();
  EXPECT_EQ(&state.InitializedMap("Hall"), &map);
}

TEST(SessionState, RetargetsSignpostsByKeyAndByNameOnlyWithoutKey) {
  SessionState state({});
  state.AddMap(1, "Hall").scene = SignpostScene(7, "Tower");
  state.AddMap(2, "Room").scene = SignpostScene(0, "Tower");
  state.AddMap(3, "Yard").scene = SignpostScene(8, "Tower");  // has the name, but leads to another map
  state.Retarget(7, "Tower", 9, "Spire");
  for (const std::uint64_t key : {1, 2}) {
    EXPECT_EQ(SignpostIn(state, key).to_key, 9U);
    EXPECT_EQ(SignpostIn(state, key).to_map, "Spire");
  }
  EXPECT_EQ(SignpostIn(state, 3).to_key, 8U);
  EXPECT_EQ(SignpostIn(state, 3).to_map, "Tower");
}

TEST(SessionState, ResolvesSignpostsOfMapsThatAreReadLater) {
  SessionState state({});
  state.AddMap(1, "Hall");
  state.AddMap(2, "Hall 2").joined_into = 1;
  state.AddMap(3, "Hall 3").joined_into = 2;
  state.AddMap(4, "Yard").discarded = true;
  const auto resolved = [&](std::uint64_t key, const std::string& map) {
    content::Signpost signpost;
    signpost.to_key = key;
    signpost.to_map = map;
    signpost.direction = Eigen::Vector3d::UnitX();
    state.Resolve(&signpost);
    return std::to_string(signpost.to_key) + signpost.to_map + (signpost.direction ? " >" : "");
  };
  EXPECT_EQ(resolved(1, "old name"), "1Hall >");
  EXPECT_EQ(resolved(0, "Hall"), "1Hall >");
  EXPECT_EQ(resolved(2, "Hall 2"), "1Hall >");
  EXPECT_EQ(resolved(3, "Hall 3"), "1Hall >") << "joined twice";
  EXPECT_EQ(resolved(0, "Hall 2"), "1Hall >");
  EXPECT_EQ(resolved(4, "Yard"), "0");
  EXPECT_EQ(resolved(0, "Yard"), "0Yard >") << "another map may have the name";
  EXPECT_EQ(resolved(9, "Attic"), "9Attic >") << "it may come from a hub later";
  EXPECT_EQ(resolved(0, ""), "0 >");
}

TEST(SessionState, UndoRestoresNoSignpostToAMapThatIsGoneOrHasAnotherName) {
  SessionState state({});
  SessionMap& map = state.AddMap(1, "Hall");
  auto scene = std::make_shared<content::Scene>(*SignpostScene(7, "Tower"));
  map.history.Do(content::TargetEdit(*scene, "sign-1", "Yard", 8), scene.get());
  map.history.Do(content::RemoveEdit(*scene, {"sign-1"}), scene.get());
  map.scene = scene;
  const auto saved = map.saved_scene = map.scene;
  state.Retarget(7, "Tower", 0, "");
  EXPECT_NE(map.scene, saved) << "the history is saved with the scene";
  state.Retarget(8, "Yard", 8, "Court");
  content::Scene undone = *map.scene;
  ASSERT_TRUE(map.history.Undo(&undone));
  EXPECT_EQ(undone.entities.front().signpost.to_key, 8U);
  EXPECT_EQ(undone.entities.front().signpost.to_map, "Court");
  ASSERT_TRUE(map.history.Undo(&undone));
  EXPECT_EQ(undone.entities.front().signpost.to_key, 0U);
  EXPECT_EQ(undone.entities.front().signpost.to_map, "");
}

TEST(SessionState, LeavesScenesThatMayNotOrNeedNotChange) {
  SessionState state({});
  SessionMap& closed = state.AddMap(1, "Hall");
  closed.policy = maps::Policy::kReadOnly;
  closed.scene = SignpostScene(7, "Tower");
  SessionMap& other = state.AddMap(2, "Room");
  other.scene = SignpostScene(8, "Yard");
  const auto closed_before = closed.scene, other_before = other.scene;
  state.Retarget(7, "Tower", 0, "");
  EXPECT_EQ(closed.scene, closed_before);
  EXPECT_EQ(other.scene, other_before);
}

TEST(SessionState, NamesTheCameraOnlyWhenThereAreSeveral) {
  EXPECT_EQ(SessionState({nullptr}).CameraPrefix(0), "");
  EXPECT_EQ(SessionState({nullptr, nullptr}).CameraPrefix(1), "camera 1: ");
}

TEST(SessionCamera, ShowsAnAdviceForFifteenSecondsFromTheLastImage) {
  SessionCamera camera;
  camera.last_time = std::chrono::seconds(20);
  camera.Advise("Move sideways.");
  EXPECT_EQ(camera.advice, "Move sideways.");
  EXPECT_EQ(camera.advice_end, std::chrono::seconds(35));
}

TEST(SessionMap, PermitsWhatItsPolicyAndItsStateAllow) {
  SessionMap map;
  EXPECT_TRUE(map.Permissions().extend);
  EXPECT_TRUE(map.Permissions().join);
  EXPECT_TRUE(map.Permissions().discard);
  map.stopped = true;
  EXPECT_FALSE(map.Permissions().extend);
  map.scene = SignpostScene(0, "");
  EXPECT_FALSE(map.Permissions().discard);  // content was placed in it
  map.policy = maps::Policy::kBounded;
  EXPECT_FALSE(map.Permissions().join);
  ASSERT_TRUE(map.Permissions().bounds);
  EXPECT_TRUE(map.Permissions().bounds->isEmpty());  // it has none, so that no keyframe is inside
  map.bounds = maps::Bounds{{0, 0, 0}, {1, 2, 3}};
  EXPECT_TRUE(map.Permissions().bounds->contains(Eigen::Vector3d(0.5, 1, 2)));
}

}  // namespace
}  // namespace docent::app

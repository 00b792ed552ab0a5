// SPDX-License-Identifier: Apache-2.0
// The meshes of maps in a session: they are read with their maps, shown with them, dropped when they no
// longer fit, and computed for idle maps.
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <thread>

#include "app/session/idle_maintenance.h"
#include "app/session/session_map.h"
#include "app/session/session_state.h"
#include "engine/base/error.h"
#include "engine/dense/densification.h"
#include "engine/system/system.h"
#include "tests/app/support/simulated_session.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using namespace simulated_session;

// The map of a short walk, made once.
std::shared_ptr<const engine::MapSnapshot> MapOfAWalk() {
  static const auto map = [] {
    const auto simulation = Room(3);
    Session session(Options(Pace::kLockstep, "map"), LensOf(*simulation), nullptr);
    Feed(simulation, Pace::kLockstep, &session);
    return session.Maps().at(0).snapshot;
  }();
  return map;
}

// One triangle, made from all keyframes of a map.
std::shared_ptr<const engine::MapMesh> MeshOf(const engine::MapSnapshot& map) {
  auto mesh = std::make_shared<engine::MapMesh>();
  mesh->mesh.vertices = {{0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
  mesh->mesh.triangles = {{0, 1, 2}};
  for (const engine::KeyFrame& keyframe : map.keyframes) {
    if (keyframe.kind == engine::KeyFrameKind::kSixDof)
      mesh->keyframes.push_back({keyframe.id, keyframe.camera_from_map});
  }
  return mesh;
}

TEST(SessionSurfaces, AreDroppedWhenAKeyFrameMoves) {
  SessionMap map;
  map.snapshot = MapOfAWalk();
  map.SetMesh(MeshOf(*map.snapshot));
  ASSERT_TRUE(map.mesh);
  EXPECT_TRUE(map.HasCurrentMesh());
  map.UpdateSnapshot(std::make_shared<engine::MapSnapshot>(*MapOfAWalk()));
  EXPECT_TRUE(map.mesh) << "nothing has moved";
  auto moved = std::make_shared<engine::MapSnapshot>(*MapOfAWalk());
  moved->keyframes.front().camera_from_map.translation.x() += moved->keyframes.front().mean_depth;
  map.UpdateSnapshot(moved);
  EXPECT_FALSE(map.mesh);
  map.SetMesh(MeshOf(*MapOfAWalk()));
  EXPECT_FALSE(map.mesh) << "it was made of another state of the map";
}

TEST(SessionSurfaces, KeepTheDepthsThatAreDoneWhenTheyAreInterrupted) {
  engine::Densification computed(MapOfAWalk());
  std::atomic<bool> interrupt = false;
  std::size_t first_done = 0;
  const auto stopped = computed.Run(
      [&](std::size_t done, std::size_t) {
        first_done = done;
        interrupt = done == 2;
      },
      &interrupt);
  EXPECT_FALSE(stopped);
  EXPECT_EQ(first_done, 2U);
  std::size_t continued_from = 0;
  const auto mesh = computed.Run([&](std::size_t done, std::size_t) {
    if (continued_from == 0) continued_from = done;
  });
  EXPECT_EQ(continued_from, 3U);
  const auto in_one_go = engine::DensifyMap(MapOfAWalk());
  ASSERT_TRUE(mesh && in_one_go);
  EXPECT_GT(mesh->mesh.triangles.size(), 0U);
  EXPECT_EQ(mesh->mesh.vertices, in_one_go->mesh.vertices);
  EXPECT_EQ(mesh->mesh.triangles, in_one_go->mesh.triangles);
}

class StoredSurfaces : public ::testing::Test {
 protected:
  StoredSurfaces() { library_.Save({key_, "Table", maps::Policy::kOpen, MapOfAWalk(), nullptr}); }

  // What a session that has the map in memory shows with a frame in it.
  Session::Shown ShownInSession(Occlusion occlusion) {
    SessionOptions options = Options(Pace::kEager, "");
    options.maintenance = false;
    options.occlusion = occlusion;
    Session session(options, LensOf(*Room(1)), &library_);
    const engine::TrackedFrame no_frame;
    session.Execute(UseMap{"Table"}, no_frame);
    engine::TrackedFrame frame;
    frame.map_key = key_;
    Session::Shown shown = session.ShownWith(frame);
    session.Finish();
    return shown;
  }

  const TemporaryFolder folder_;
  maps::Library library_ =
      maps::Library::Open(folder_ / "a.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  const std::uint64_t key_ = library_.NewKey();
};

TEST_F(StoredSurfaces, AreShownWithTheirMapUnlessSwitchedOff) {
  EXPECT_FALSE(ShownInSession(Occlusion::kMap).surfaces) << "the map has no mesh yet";
  ASSERT_TRUE(library_.SaveMesh(key_, *MeshOf(*MapOfAWalk())));
  const Session::Shown shown = ShownInSession(Occlusion::kMap);
  ASSERT_TRUE(shown.surfaces);
  EXPECT_EQ(shown.surfaces->triangles.size(), 1U);
  EXPECT_FALSE(ShownInSession(Occlusion::kProxies).surfaces);
  EXPECT_TRUE(ShownInSession(Occlusion::kProxies).occluders);
  EXPECT_FALSE(ShownInSession(Occlusion::kOff).occluders);
}

TEST_F(StoredSurfaces, AreComputedWhileTheSessionIsIdle) {
  Session session(Options(Pace::kEager, ""), LensOf(*Room(1)), &library_);
  // Seconds for each keyframe; three minutes at most, as the machine may be slow.
  for (int i = 0; i < 1800 && !library_.LoadMesh(key_); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  session.Finish();
  const auto mesh = library_.LoadMesh(key_);
  ASSERT_TRUE(mesh);
  EXPECT_GT(mesh->mesh.triangles.size(), 100U);
  EXPECT_EQ(engine::StateOf(mesh->keyframes, *library_.Load(key_).snapshot), engine::MeshState::kCurrent);
}

TEST_F(StoredSurfaces, AreComputedOnceWhenTheyCannotBeSaved) {
  maps::Library read_only = maps::Library::Open(folder_ / "a.docent", maps::Access::kReadOnly);
  const auto cameras = LensOf(*Room(1));
  engine::System system(Options(Pace::kEager, ""), cameras);
  while (!system.IsMapperIdle()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  std::mutex mutex;
  SessionState state(cameras);
  SessionMap& map = state.maps[key_];
  map.key = key_;
  map.in_library = true;
  map.snapshot = map.saved_snapshot = MapOfAWalk();
  map.saved_scene = map.scene;
  map.maintained_revision = map.snapshot->revision;
  IdleMaintenance maintenance(&read_only, &system, &mutex, &state, /*with_meshes=*/true,
                              /*with_light=*/false);
  const std::atomic<bool> go_on = false;
  EXPECT_THROW(maintenance.Run(go_on), Error);
  EXPECT_TRUE(map.mesh) << "this session can use them";
  EXPECT_FALSE(maintenance.Run(go_on)) << "it would take seconds for each keyframe again";
}

}  // namespace
}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#include "app/session/session_memory.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "content/edits.h"
#include "tests/app/support/simulated_session.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

// A map is read after the one that its signposts lead to was joined into another one, which is not saved yet.
TEST(SessionMemory, ReadsSignpostsAndChangesOfThemThatFollowAJoinedMap) {
  const TemporaryFolder folder;
  maps::Library library =
      OpenLibrary(folder / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  for (const char* name : {"Hall", "Hall 2", "Yard"})
    library.Save({library.NewKey(), name, maps::Policy::kOpen, nullptr, nullptr});
  content::Scene scene;
  content::EditHistory history;
  for (const char* name : {"kept", "removed"}) {
    content::Entity sign;
    sign.name = name;
    sign.signpost.to_key = 2;
    sign.signpost.to_map = "Hall 2";
    history.Do(content::AddEdit(scene, sign), &scene);
  }
  history.Do(content::RemoveEdit(scene, {"removed"}), &scene);
  maps::MapRecord record;
  record.key = 3;
  record.scene = std::make_shared<maps::SceneRecord>(RecordFromScene(scene));
  record.history = std::make_shared<maps::SceneRecord>(RecordFromHistory(history, scene));
  library.Save(record);

  SessionOptions options = simulated_session::Options(Pace::kLockstep, "");
  options.memory.left_out = {3};  // Not read at the start.
  const auto cameras = simulated_session::LensOf(*simulated_session::Room(1));
  engine::System system(options, cameras);
  std::mutex mutex;
  SessionState state(cameras);
  SessionAssets assets;
  SessionMemory memory(options, &library, &system, &mutex, &state, &assets);
  memory.Open();
  SessionMap& yard = *state.FindMap(3);
  ASSERT_FALSE(yard.snapshot);
  state.FindMap(2)->joined_into = 1;
  memory.LoadFor(UseMap{"Yard"});
  ASSERT_TRUE(yard.snapshot);
  EXPECT_FALSE(yard.NeedsSave()) << "the library does the same when it saves the joined map";
  content::Scene undone = *yard.scene;
  ASSERT_TRUE(yard.history.Undo(&undone));
  for (const char* name : {"kept", "removed"}) {
    EXPECT_EQ(undone.Find(name)->signpost.to_key, 1u) << name;
    EXPECT_EQ(undone.Find(name)->signpost.to_map, "Hall") << name;
  }
}

void SaveSign(const std::string& text, maps::Library* library) {
  content::Scene scene;
  content::Entity sign;
  sign.name = "sign";
  sign.signpost.text = text;
  scene.entities.push_back(sign);
  maps::MapRecord record;
  record.key = 1;
  record.name = "Hall";
  record.scene = std::make_shared<maps::SceneRecord>(RecordFromScene(scene));
  library->Save(record);
}

TEST(SessionMemory, ShowsContentThatAHubHasUpdatedWhileItsMapWasRead) {
  const TemporaryFolder folder;
  maps::Library library =
      OpenLibrary(folder / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  ASSERT_EQ(library.NewKey(), 1u);
  SaveSign("old", &library);
  SessionOptions options = simulated_session::Options(Pace::kEager, "");
  options.may_write = false;
  options.memory.wait_for_maps = false;
  options.memory.left_out = {1};  // Not read at the start.
  const auto cameras = simulated_session::LensOf(*simulated_session::Room(1));
  engine::System system(options, cameras);
  std::mutex mutex;
  SessionState state(cameras);
  SessionAssets assets;
  SessionMemory memory(options, &library, &system, &mutex, &state, &assets);
  memory.Open();
  auto towards = std::make_shared<content::Scene>();
  content::Entity sign;
  sign.signpost.to_key = 1;
  towards->entities.push_back(sign);
  SessionMap yard;
  yard.scene = towards;
  {
    const std::scoped_lock lock(mutex);
    memory.ExpectNeighbours(yard);
    // The map is read meanwhile, but cannot be added yet. If it is read later, it is the new one anyway.
    std::this_thread::sleep_for(std::chrono::seconds(1));
    SaveSign("new", &library);
  }
  std::string shown;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(120);
  while (shown != "new" && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const std::scoped_lock lock(mutex);
    const content::Entity* const found = state.FindMap(1)->scene->Find("sign");
    if (found != nullptr) shown = found->signpost.text;
  }
  EXPECT_EQ(shown, "new");
}

TEST(SessionMemory, ForgetsModelsThatAHubHasReplaced) {
  const TemporaryFolder folder;
  maps::Library library =
      OpenLibrary(folder / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  const std::uint64_t key = library.NewKey();
  const auto save = [&](const std::string& corner) {
    content::Scene scene;
    content::Entity fox;
    fox.kind = content::Entity::Kind::kModel;
    fox.name = "fox";
    fox.model.asset = std::make_shared<content::Asset>(
        content::ImportAsset(folder.Write("fox.obj", "v 0 0 0\nv " + corner + " 0 0\nv 0 1 0\nf 1 2 3\n")));
    scene.entities.push_back(fox);
    maps::MapRecord record;
    record.key = key;
    record.name = "Hall";
    record.scene = std::make_shared<maps::SceneRecord>(RecordFromScene(scene));
    library.Save(record);
  };
  save("1");
  SessionOptions options = simulated_session::Options(Pace::kLockstep, "");
  options.may_write = false;
  const auto cameras = simulated_session::LensOf(*simulated_session::Room(1));
  engine::System system(options, cameras);
  std::mutex mutex;
  SessionState state(cameras);
  SessionAssets assets;
  SessionMemory memory(options, &library, &system, &mutex, &state, &assets);
  memory.Open();
  EXPECT_EQ(assets.all().size(), 1u);
  for (const char* corner : {"2", "3", "4"}) {
    save(corner);
    EXPECT_TRUE(memory.ReloadContent(key));
    EXPECT_EQ(assets.all().size(), 1u) << corner;
  }
}

}  // namespace
}  // namespace docent::app

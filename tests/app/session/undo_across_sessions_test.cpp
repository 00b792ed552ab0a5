// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/demo/exhibit_model.h"
#include "app/session/library_scene.h"
#include "app/session/session.h"
#include "content/edits.h"
#include "tests/app/support/simulated_session.h"
#include "tests/app/support/temporary_folder.h"

namespace docent::app {
namespace {

using namespace simulated_session;

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TimedCommand At(double seconds, Command command) {
  return {FromSeconds(seconds), 1, std::move(command)};
}

// A library in which a model and a signpost were placed, and the model was removed again.
class UndoAcrossSessions : public ::testing::Test {
 protected:
  UndoAcrossSessions() {
    const std::vector<std::uint8_t> glb = MakeExhibitGlb();
    folder_.Write("exhibit.glb", {glb.begin(), glb.end()});
    const Eigen::Vector2d pixel(320, 290);
    Run(Room(4), {At(0, NewMap{"Desk"}), At(3, PlaceModel{"exhibit.glb", pixel, 0.3, 20}),
                  At(3.1, PlaceSignpost{"here", pixel, ""}), At(3.3, RemoveEntities{{"exhibit"}})});
  }
  // The names in the map after a session with these commands, and its warnings.
  std::vector<std::string> Run(std::vector<TimedCommand> script) { return Run(Room(0.8), std::move(script)); }
  std::vector<std::string> Run(const std::shared_ptr<const Simulation>& simulation,
                               std::vector<TimedCommand> script) {
    maps::Library library = OpenLibrary(file_, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    Session session(Options(Pace::kLockstep, ""), LensOf(*simulation), &library);
    Feed(simulation, Pace::kLockstep, &session, std::move(script), folder_.path());
    warnings_.clear();
    for (const Event& event : session.TakeEvents()) {
      if (event.event == "warning") warnings_.push_back(event.detail);
    }
    std::vector<std::string> names;
    for (const content::Entity& entity : session.Maps().at(0).scene->entities) names.push_back(entity.name);
    return names;
  }
  content::Scene StoredScene() const {
    const maps::Library library = OpenLibrary(file_, maps::Access::kReadOnly);
    EXPECT_THAT(library.Verify(), IsEmpty());
    AssetCache assets;
    return SceneFromRecord(library.LoadScene(library.FindByName("Desk").key), "scene", &assets);
  }

  const TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "l.docent";
  std::vector<std::string> warnings_;
};

TEST_F(UndoAcrossSessions, UndoesTheLastChangeOfTheLastSession) {
  ASSERT_EQ(StoredScene().entities.size(), 1u);
  EXPECT_THAT(Run({At(0, UseMap{"Desk"}), At(0.4, Undo{})}), ElementsAre("exhibit", "sign-1"));
  const content::Scene scene = StoredScene();
  ASSERT_NE(scene.Find("exhibit"), nullptr);
  EXPECT_NEAR(scene.Find("exhibit")->model.map_from_model.scale, 0.3, 0.003) << "it moved with its anchor";
  EXPECT_THAT(Run({At(0, UseMap{"Desk"}), At(0.4, Redo{})}), ElementsAre("sign-1"));
  EXPECT_THAT(Run({At(0, UseMap{"Desk"}), At(0.4, Undo{}), At(0.5, Undo{}), At(0.6, Undo{})}), IsEmpty());
  EXPECT_THAT(Run({At(0, UseMap{"Desk"}), At(0.4, Redo{})}), ElementsAre("exhibit"));
  EXPECT_THAT(warnings_, IsEmpty());
}

TEST_F(UndoAcrossSessions, IsNotTriedWhereTheSceneWasChangedInAnotherWay) {
  {
    maps::Library library = OpenLibrary(file_, maps::Access::kReadWrite);
    maps::MapRecord record;
    record.key = library.FindByName("Desk").key;
    record.scene = std::make_shared<maps::SceneRecord>(RecordFromScene({}));
    library.Save(record);
  }
  EXPECT_THAT(ErrorOf([&] { Run({At(0, UseMap{"Desk"}), At(0.4, Undo{})}); }), HasSubstr("nothing to undo"));
  EXPECT_THAT(StoredScene().entities, IsEmpty());
}

TEST_F(UndoAcrossSessions, IsLostAloneWhenTheHistoryIsDamaged) {
  {
    maps::Library library = OpenLibrary(file_, maps::Access::kReadWrite);
    maps::MapRecord record;
    record.key = library.FindByName("Desk").key;
    record.history = std::make_shared<maps::SceneRecord>(maps::SceneRecord{"{\"docent_history\": 2", {}});
    library.Save(record);
  }
  EXPECT_THAT(ErrorOf([&] { Run({At(0, UseMap{"Desk"}), At(0.4, Undo{})}); }), HasSubstr("nothing to undo"));
  EXPECT_THAT(Run({At(0, UseMap{"Desk"})}), ElementsAre("sign-1"));
  EXPECT_THAT(warnings_, Contains(HasSubstr("earlier changes cannot be undone")));
}

TEST(StoredHistories, RestoreNoSignpostToAMapThatIsGoneOrHasAnotherName) {
  const TemporaryFolder folder;
  maps::Library library =
      OpenLibrary(folder / "l.docent", maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
  for (const char* name : {"Hall", "Tower", "Yard"})
    library.Save({library.NewKey(), name, maps::Policy::kOpen, nullptr, nullptr});
  content::Scene scene;
  content::EditHistory history;
  content::Entity sign;
  sign.name = "sign-1";
  sign.signpost.to_key = 2;
  sign.signpost.to_map = "Tower";
  sign.signpost.direction = Eigen::Vector3d::UnitX();
  history.Do(content::AddEdit(scene, sign), &scene);
  history.Do(content::TargetEdit(scene, "sign-1", "Yard", 3), &scene);
  history.Do(content::RemoveEdit(scene, {"sign-1"}), &scene);
  maps::MapRecord record;
  record.key = 1;
  record.scene = std::make_shared<maps::SceneRecord>(RecordFromScene(scene));
  record.history = std::make_shared<maps::SceneRecord>(RecordFromHistory(history, scene));
  library.Save(record);
  library.Rename(3, "Court");
  library.Remove(2);
  AssetCache assets;
  content::EditHistory stored = HistoryFromRecord(library.LoadHistory(1).value(), "history", &assets);
  ASSERT_TRUE(stored.Undo(&scene));
  EXPECT_EQ(scene.entities.at(0).signpost.to_key, 3u);
  EXPECT_EQ(scene.entities.at(0).signpost.to_map, "Court");
  ASSERT_TRUE(stored.Undo(&scene));
  EXPECT_EQ(scene.entities.at(0).signpost.to_key, 0u);
  EXPECT_EQ(scene.entities.at(0).signpost.to_map, "");
  EXPECT_FALSE(scene.entities.at(0).signpost.direction);
  EXPECT_THAT(library.Verify(), IsEmpty());
}

TEST(StoredHistories, KeepTheNewestChangesWithinTheLimitOfTheirModels) {
  content::Scene scene;
  content::EditHistory history;
  const auto model_of = [](std::size_t megabytes, int number) {
    auto asset = std::make_shared<content::Asset>(content::Asset());
    asset->id = "asset-" + std::to_string(number);
    asset->bytes.resize(megabytes << 20);
    content::Entity entity;
    entity.name = "model-" + std::to_string(number);
    entity.kind = content::Entity::Kind::kModel;
    entity.model.asset = asset;
    return entity;
  };
  for (int i = 0; i < 4; ++i) {
    history.Do(content::AddEdit(scene, model_of(25, i)), &scene);
    history.Do(content::RemoveEdit(scene, {"model-" + std::to_string(i)}), &scene);
  }
  const maps::SceneRecord record = RecordFromHistory(history, scene);
  // Two of 25 MB are within 64 MiB, three are not.
  std::vector<std::string> ids;
  for (const maps::AssetRecord& asset : record.assets) ids.push_back(asset.id);
  EXPECT_THAT(ids, ElementsAre("asset-2", "asset-3"));
  // A model that the scene itself uses does not count.
  history.Do(content::AddEdit(scene, model_of(60, 9)), &scene);
  EXPECT_EQ(RecordFromHistory(history, scene).assets.size(), 3u);
  EXPECT_EQ(RecordFromHistory({}, scene).text, "");
}

}  // namespace
}  // namespace docent::app

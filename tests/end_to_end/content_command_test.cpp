// SPDX-License-Identifier: Apache-2.0
// Tests of docent content, by the real program.
#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/demo/exhibit_model.h"
#include "app/session/library_scene.h"
#include "maps/library/library.h"
#include "tests/app/support/temporary_folder.h"
#include "tests/end_to_end/run_docent.h"

namespace docent::app {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(ContentCommand, ListsInWhichLanguagesATextIsMissing) {
  const TemporaryFolder folder;
  const std::string path = (folder / "museum.docent").string();
  {
    maps::Library library = maps::Library::Open(path, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    for (const char* name : {"Desk", "Kiosk"})
      library.Save({library.NewKey(), name, maps::Policy::kOpen, nullptr, nullptr});
  }
  for (const char* map : {"Desk", "Kiosk"}) {
    const Outcome outcome = RunDocent(
        {"content", "add", "--library", path, "--map", map, "--signpost", "Lions", "--at", "0", "0", "2"});
    ASSERT_EQ(outcome.exit_status, 0) << outcome.errors;
  }
  const auto listed = [&] {
    return RunDocent({"content", "list", "--library", path, "--map", "Kiosk"}).output;
  };
  EXPECT_THAT(listed(), HasSubstr("Lions\n"));
  ASSERT_EQ(RunDocent({"content", "edit", "sign-1", "--text", "Löwen", "--language", "de", "--library", path,
                       "--map", "Desk"})
                .exit_status,
            0);
  EXPECT_THAT(listed(), HasSubstr("Lions  (not in de)\n")) << "the other map has a text in German";
}

TEST(ContentCommand, EditsTheContentOfASavedMap) {
  const TemporaryFolder folder;
  const std::string path = (folder / "museum.docent").string();
  const std::vector<std::uint8_t> glb = MakeExhibitGlb();
  const std::string model = folder.Write("exhibit.glb", {glb.begin(), glb.end()}).string();
  std::uint64_t kiosk = 0;
  {
    maps::Library library = maps::Library::Open(path, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    for (const char* name : {"Desk", "Kiosk"}) {
      kiosk = library.NewKey();
      library.Save({kiosk, name, maps::Policy::kOpen, nullptr, nullptr});
    }
  }
  const auto run = [&](const std::string& verb, std::vector<std::string> more) {
    more.insert(more.begin(), {"content", verb, "--library", path, "--map", "Desk"});
    return more;
  };
  ASSERT_EQ(RunDocent(run("add", {model, "--at", "1", "2", "3"})).exit_status, 0);
  ASSERT_EQ(RunDocent(run("add", {"--signpost", "x", "--at", "0", "0", "2"})).exit_status, 0);
  const auto edited = [&](const std::vector<std::string>& more) {
    const Outcome outcome = RunDocent(run("edit", more));
    EXPECT_EQ(outcome.exit_status, 0) << outcome.errors;
    const maps::Library library = maps::Library::Open(path, maps::Access::kReadOnly);
    EXPECT_THAT(library.Verify(), IsEmpty());
    AssetCache assets;
    return SceneFromRecord(library.LoadScene(library.FindByName("Desk").key), "Desk", &assets);
  };
  content::Scene scene =
      edited({"exhibit", "--move", "-1", "0.5", "0", "--scale", "2", "--rotate", "180", "--lock"});
  const engine::Sim3 pose = scene.Find("exhibit")->model.map_from_model;
  EXPECT_LT((pose.translation - Eigen::Vector3d(0, 2.5, 3)).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(pose.scale, 2);
  // At yaw 0 the front faces -z; half a turn makes it +z.
  EXPECT_LT((pose.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  EXPECT_TRUE(scene.Find("exhibit")->locked);
  ExpectErrorLine(run("edit", {"exhibit", "--hide"}), 1, "'exhibit' is locked; unlock it to change it.");
  EXPECT_THAT(RunDocent({"content", "list", "--library", path}).output, HasSubstr("(locked)"));

  scene = edited({"exhibit", "sign-1", "--duplicate"});
  EXPECT_EQ(scene.entities.size(), 4u);
  scene = edited({"exhibit", "exhibit-2", "--unlock", "--group", "pair", "--hide"});
  EXPECT_TRUE(scene.Find("exhibit-2")->hidden);
  EXPECT_EQ(scene.Find("exhibit")->group, "pair");
  scene = edited({"exhibit", "exhibit-2", "--ungroup", "--show"});
  EXPECT_FALSE(scene.Find("exhibit-2")->hidden);
  EXPECT_EQ(scene.Find("exhibit")->group, "");
  scene = edited({"sign-1", "--text", "To the kiosk", "--to", "Kiosk", "--rename", "kiosk sign"});
  EXPECT_EQ(scene.Find("kiosk sign")->signpost.text, "To the kiosk");
  EXPECT_EQ(scene.Find("kiosk sign")->signpost.to_key, kiosk);
  const auto listed = [&] { return RunDocent({"content", "list", "--library", path}).output; };
  EXPECT_THAT(listed(), HasSubstr("To the kiosk  (no direction)\n"));
  scene = edited({"kiosk sign", "--direction", "0", "-3", "4"});
  EXPECT_THAT(listed(), HasSubstr("To the kiosk\n"));
  EXPECT_LT((scene.Find("kiosk sign")->signpost.direction.value() - Eigen::Vector3d(0, -0.6, 0.8)).norm(),
            1e-12);
  ExpectErrorLine(run("edit", {"kiosk sign", "--find-direction"}), 1,
                  "where 'Kiosk' begins is not known from here");
  scene = edited({"kiosk sign", "--no-direction"});
  EXPECT_FALSE(scene.Find("kiosk sign")->signpost.direction);
  scene = edited({"kiosk sign", "--direction", "1", "0", "0", "--lock"});
  scene = edited(
      {"kiosk sign", "--to-nowhere", "--unlock", "--transform", "1", "2", "3", "0", "0", "0", "1", "0.5"});
  EXPECT_EQ(scene.Find("kiosk sign")->signpost.to_map, "");
  EXPECT_FALSE(scene.Find("kiosk sign")->signpost.direction) << "it led to the kiosk";
  EXPECT_EQ(scene.Find("kiosk sign")->signpost.anchor, Eigen::Vector3d(1, 2, 3));
  scene = edited({"exhibit", "--align", "0 0 0 to 5 0 0, 1 0 0 to 8 0 0, 0 1 0 to 5 3 0"});
  EXPECT_NEAR(scene.Find("exhibit")->model.map_from_model.scale, 3, 1e-9);
  EXPECT_LT((content::PlaceOf(*scene.Find("exhibit")) - Eigen::Vector3d(5, 0, 0)).norm(), 1e-9);
  const std::string corners = "0 0 0 to 5 0 0, 1 0 0 to 8 0 1, 0 1 0 to 5 3 0, 0 0 1 to 5 0 3";
  EXPECT_NE(edited({"exhibit", "--bend", corners}).Find("exhibit")->model.warp, nullptr);
  EXPECT_EQ(edited({"exhibit", "--unbend"}).Find("exhibit")->model.warp, nullptr);

  const std::string before = RunDocent({"content", "list", "--json", "--library", path}).output;
  ExpectErrorLine(run("edit", {"exhibit"}), 2, "No change is given");
  ExpectErrorLine(run("add", {"bell.wav", "--at", "0", "0", "2"}), 2, "a sound needs a caption");
  for (const char* option : {"--scale", "--yaw"})
    ExpectErrorLine(run("add", {"bell.wav", "--caption", "Bell", "--at", "0", "0", "2", option, "2"}), 2,
                    std::string(option) + ": is not for a sound");
  ExpectErrorLine(
      run("add", {"bell.wav", "--caption", "Bell", "--at", "0", "0", "2", "--rotation", "0", "0", "0", "1"}),
      2, "--rotation: is not for a sound");
  for (const std::string& file : {model, std::string("plan.png")}) {
    ExpectErrorLine(run("add", {file, "--at", "0", "0", "2", "--caption", "Fox"}), 2,
                    "--caption: is only for a sound");
    ExpectErrorLine(run("add", {file, "--at", "0", "0", "2", "--range", "2"}), 2,
                    "--range: is only for a sound");
  }
  ExpectErrorLine(run("add", {"--trail", "0 1"}), 2, "--trail");
  ExpectErrorLine(run("add", {"--trail", "0 1 1, pixel 1 1"}), 2, "no image with this pixel");
  ExpectErrorLine(run("add", {"--occluder", "ball at 0 0 1"}), 2, "--occluder");
  ExpectErrorLine(run("edit", {"fox", "--hide"}), 1, "no 'fox'");
  ExpectErrorLine(run("edit", {"exhibit", "--text", "x"}), 1, "is a model");
  ExpectErrorLine(run("edit", {"exhibit", "exhibit-2", "--rename", "x"}), 2, "not several");
  ExpectErrorLine(run("edit", {"kiosk sign", "--to", "Desk"}), 1, "its own map");
  ExpectErrorLine(run("edit", {"kiosk sign", "--to", "Attic"}), 1, "Attic");
  ExpectErrorLine(run("edit", {"kiosk sign", "--direction", "0", "0", "0"}), 2, "the direction is too short");
  ExpectErrorLine(run("edit", {"kiosk sign", "--find-direction"}), 1, "'kiosk sign' leads to no map");
  ExpectErrorLine(run("edit", {"exhibit", "--direction", "0", "0", "1"}), 1, "a model, which has no arrow");
  ExpectErrorLine(run("edit", {"kiosk sign", "--direction", "0", "0", "1", "--no-direction"}), 2,
                  "--no-direction");
  ExpectErrorLine(run("edit", {"exhibit", "--scale", "0"}), 2, "--scale");
  ExpectErrorLine(run("edit", {"exhibit", "--align", "0 0 0 to 1 1 1"}), 2, "at least 3 points");
  ExpectErrorLine(run("edit", {"exhibit", "--align", "0 0 0 to pixel 1 1, 1 0 0 to 1 0 0, 0 1 0 to 1 1 0"}),
                  1, "no image");
  ExpectErrorLine(run("edit", {"exhibit", "--bend", corners + "\n0 map stop"}), 2, "--bend");
  // What cannot be carried out as a whole changes nothing.
  ExpectErrorLine(run("edit", {"exhibit", "--move", "1", "0", "0", "--unbend"}), 1, "is not bent");
  ExpectErrorLine(run("edit", {"exhibit", "--move", "1", "0", "0", "--rename", "exhibit-2"}), 1, "already");
  EXPECT_EQ(RunDocent({"content", "list", "--json", "--library", path}).output, before);
}

TEST(ContentCommand, KeepsChangesOfSavedContentUndoable) {
  const TemporaryFolder folder;
  const std::string path = (folder / "museum.docent").string();
  const std::vector<std::uint8_t> glb = MakeExhibitGlb();
  const std::string model = folder.Write("exhibit.glb", {glb.begin(), glb.end()}).string();
  {
    maps::Library library = maps::Library::Open(path, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    library.Save({library.NewKey(), "Desk", maps::Policy::kOpen, nullptr, nullptr});
  }
  const auto run = [&](const std::string& verb, std::vector<std::string> more) {
    more.insert(more.begin(), {"content", verb, "--library", path, "--map", "Desk"});
    const Outcome outcome = RunDocent(more);
    EXPECT_EQ(outcome.exit_status, 0) << outcome.errors;
  };
  run("add", {model, "--at", "1", "2", "3"});
  run("edit", {"exhibit", "--move", "1", "0", "0", "--scale", "2"});
  run("remove", {"exhibit"});

  const maps::Library library = maps::Library::Open(path, maps::Access::kReadOnly);
  const std::uint64_t key = library.FindByName("Desk").key;
  AssetCache assets;
  content::Scene scene = SceneFromRecord(library.LoadScene(key), "Desk", &assets);
  EXPECT_THAT(scene.entities, IsEmpty());
  const auto stored = library.LoadHistory(key);
  ASSERT_TRUE(stored.has_value());
  content::EditHistory history = HistoryFromRecord(*stored, "Desk", &assets);
  ASSERT_EQ(history.done().size(), 3u);
  EXPECT_EQ(history.done()[1].label, "scale 'exhibit' and more");
  ASSERT_TRUE(history.Undo(&scene));
  EXPECT_EQ(scene.Find("exhibit")->model.map_from_model.scale, 2);
  ASSERT_TRUE(history.Undo(&scene));
  EXPECT_EQ(scene.Find("exhibit")->model.map_from_model.scale, 1);
  EXPECT_LT((scene.Find("exhibit")->model.map_from_model.translation - Eigen::Vector3d(1, 2, 3)).norm(),
            1e-9);
  ASSERT_TRUE(history.Undo(&scene));
  EXPECT_THAT(scene.entities, IsEmpty());
}

TEST(ContentCommand, AddsModelsAndSignpostsToASavedMap) {
  const TemporaryFolder folder;
  const std::string path = (folder / "museum.docent").string();
  const std::vector<std::uint8_t> glb = MakeExhibitGlb();
  const std::string model = folder.Write("exhibit.glb", {glb.begin(), glb.end()}).string();
  {
    maps::Library library = maps::Library::Open(path, maps::Access::kReadWrite, maps::CreateIfMissing::kYes);
    for (const char* name : {"Desk", "Kiosk"}) {
      library.Save({library.NewKey(), name, maps::Policy::kOpen, nullptr, nullptr});
    }
  }
  const auto arguments = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"content", "add", "--library", path, "--map", "Desk"});
    return more;
  };
  const auto added = [&](const std::vector<std::string>& more) {
    const Outcome outcome = RunDocent(arguments(more));
    EXPECT_EQ(outcome.exit_status, 0) << outcome.errors;
    return outcome.output;
  };
  EXPECT_EQ(added({model, "--at", "1", "-2", "3.5", "--scale", "0.25", "--yaw", "-90"}), "exhibit\n");
  EXPECT_EQ(added({model, "--at", "0", "0", "0", "--rotation", "0", "1", "0", "0"}), "exhibit-2\n");
  EXPECT_EQ(added({model, "--at", "0", "0", "0", "--name", "obelisk"}), "obelisk\n");
  EXPECT_EQ(added({"--signpost", "To the kiosk", "--at", "-1", "0", "2", "--to", "Kiosk", "--height", "0.5",
                   "--direction", "-2", "0", "0"}),
            "sign-1\n");
  EXPECT_EQ(added({"--signpost", "Café", "--at", "-1", "0", "2", "--quiet"}), "");

  const Outcome list = RunDocent({"content", "list", "--library", path, "--json"});
  const auto content = nlohmann::json::parse(list.output).at("content");
  ASSERT_EQ(content.size(), 5u);
  EXPECT_EQ(content[0]["position"], nlohmann::json({1.0, -2.0, 3.5}));
  EXPECT_EQ(content[0]["scale"], 0.25);
  EXPECT_EQ(content[0]["file"], "exhibit.glb");
  EXPECT_EQ(content[3]["to_map"], "Kiosk");
  EXPECT_EQ(content[3]["direction"], nlohmann::json({-1.0, 0.0, 0.0}));
  EXPECT_TRUE(content[4]["direction"].is_null());
  EXPECT_EQ(content[4]["text"], "Café");
  {
    const maps::Library library = maps::Library::Open(path, maps::Access::kReadOnly);
    EXPECT_THAT(library.Verify(), IsEmpty());
    const maps::SceneRecord record = library.LoadScene(library.FindByName("Desk").key);
    EXPECT_EQ(record.assets.size(), 1u) << "the same model is stored once";
    AssetCache assets;
    const content::Scene scene = SceneFromRecord(record, "Desk", &assets);
    const engine::Sim3& upright = scene.entities[0].model.map_from_model;
    // Up is -y of a map without keyframes. At yaw 0 the front faces -z; -90 degrees turn it clockwise seen
    // from above.
    EXPECT_LT((upright.rotation * Eigen::Vector3d::UnitY() + Eigen::Vector3d::UnitY()).norm(), 1e-9);
    EXPECT_LT((upright.rotation * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitX()).norm(), 1e-9);
    const engine::Sim3& free = scene.entities[1].model.map_from_model;
    EXPECT_LT((free.rotation * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitZ()).norm(), 1e-9);
    EXPECT_EQ(scene.entities[3].signpost.height, 0.5);
  }

  const auto list_content = [&] { return RunDocent({"content", "list", "--library", path}).output; };
  const std::string before = list_content();
  ExpectErrorLine(arguments({model, "--at", "0", "0", "0", "--name", "obelisk"}), 1, "already a 'obelisk'");
  ExpectErrorLine(arguments({"none.glb", "--at", "0", "0", "0"}), 1, "none.glb");
  ExpectErrorLine(arguments({"--signpost", "x", "--at", "0", "0", "0", "--to", "Nowhere"}), 1, "Nowhere");
  ExpectErrorLine(arguments({"--signpost", std::string(10'001, 'x'), "--at", "0", "0", "0"}), 1,
                  "10000 bytes");
  ExpectErrorLine(arguments({"--signpost", "caf\xE9", "--at", "0", "0", "0"}), 1, "UTF-8");
  ExpectErrorLine(arguments({model, "--at", "0", "0", "1e300"}), 2, "--at");
  ExpectErrorLine(arguments({model, "--at", "0", "0", "0", "--direction", "0", "0", "1"}), 2, "--direction");
  ExpectErrorLine(arguments({"--signpost", "x", "--at", "0", "0", "0", "--direction", "0", "0", "0"}), 2,
                  "too short");
  ExpectErrorLine(arguments({model, "--at", "0", "0"}), 2, "--at");
  ExpectErrorLine(arguments({model, "--at", "0", "0", "nan"}), 2, "'nan' is not a number");
  ExpectErrorLine(arguments({model, "--at", "0", "0", "0", "--scale", "1e12"}), 2, "--scale");
  ExpectErrorLine(arguments({model, "--at", "0", "0", "0", "--scale", "0"}), 2, "--scale");
  ExpectErrorLine(arguments({model, "--at", "0", "0", "0", "--rotation", "1", "1", "0", "0"}), 2, "length 1");
  ExpectErrorLine(arguments({model, "--at", "0", "0", "0", "--signpost", "x"}), 2, "excludes");
  ExpectErrorLine(arguments({model}), 2, "--at is required");
  ExpectErrorLine(arguments({"--at", "0", "0", "0"}), 2, "--label TEXT, --trail POINTS or --occluder SHAPE");
  EXPECT_EQ(list_content(), before);

  ExpectErrorLine(arguments({"--signpost", "x", "--at", "0", "0", "0", "--to", "Desk"}), 1, "its own map");
  EXPECT_EQ(list_content(), before);

  EXPECT_EQ(RunDocent({"maps", "policy", "Desk", "read-only", "--library", path}).exit_status, 0);
  ExpectErrorLine(arguments({model, "--at", "0", "0", "0"}), 1, "read-only");
  EXPECT_EQ(RunDocent({"maps", "policy", "Desk", "augment-only", "--library", path}).exit_status, 0);
  EXPECT_EQ(RunDocent({"content", "remove", "exhibit", "--map", "Desk", "--library", path}).exit_status, 0);
  EXPECT_EQ(RunDocent({"content", "remove", "exhibit-2", "obelisk", "--map", "Desk", "--library", path})
                .exit_status,
            0);
  ExpectErrorLine({"content", "remove", "exhibit", "--map", "Desk", "--library", path}, 1, "no 'exhibit'");
  const maps::Library library = maps::Library::Open(path, maps::Access::kReadOnly);
  EXPECT_TRUE(library.LoadScene(library.FindByName("Desk").key).assets.empty());
}

}  // namespace
}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#include "maps/hub/sync_state.h"

#include <gmock/gmock.h>

#include <fstream>
#include <functional>

#include "engine/base/error.h"
#include "maps/hub/local_library.h"
#include "tests/hub/hub_samples.h"
#include "tests/hub/private_server.h"

// The file beside a library that says what it and its hub have in common, written by somebody else.
namespace docent::maps {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

class HubState : public WithHubServer {
 protected:
  void AddSign(const std::string& device, const std::string& name, const std::string& text) {
    AddSampleSignpost(folder_ / device, "Desk", name, text);
  }
  // All texts of all maps.
  std::string AllTexts(const std::string& device) {
    const Library library = OpenSampleLibrary(folder_ / device);
    EXPECT_THAT(library.Verify(), IsEmpty());
    std::string texts;
    for (const MapInfo& info : library.List()) texts += TextsIn(library, info.key) + " ";
    return texts;
  }

  TemporaryFolder folder_;
};

TEST_F(HubState, ADamagedOrHostileFileCostsNoMap) {
  {
    Library a = OpenSampleLibrary(folder_ / "a");
    AddSampleMap(&a, "Desk", 7);
    AddSampleMap(&a, "Hall", 8);
  }
  Push(SampleSync(Url(), folder_ / "a"));
  Pull(SampleSync(Url(), folder_ / "b"));
  AddSign("b", "sign-2", "theirs");
  Push(SampleSync(Url(), folder_ / "b"));
  AddSign("a", "sign-3", "mine");
  const std::vector<std::string> attacks = {
      "",  // No database at all.
      "PRAGMA application_id = 1",
      "PRAGMA user_version = 99",
      "DELETE FROM hub",
      "UPDATE hub SET id = 'x'; DROP TABLE links",
      "DROP TABLE links",
      "UPDATE links SET key = 0 WHERE name = 'Desk'",
      "UPDATE links SET key = 77 WHERE name = 'Desk'",
      "UPDATE links SET key = -key; UPDATE links SET key = CASE name WHEN 'Desk' THEN 2 ELSE 1 END",
      "UPDATE links SET revision = 999",
      "UPDATE links SET revision = -1",
      "UPDATE links SET id = '../../etc/passwd' WHERE name = 'Desk'",
      "UPDATE links SET structure = 'x'",
      "UPDATE links SET scene = '{\"entities\": ['",
      "UPDATE links SET scene = ''",
      "UPDATE links SET name = char(10) || name",
      "UPDATE links SET policy = 'none'",
      "INSERT INTO tours (name, revision, content) VALUES ('T', 5, 'x')",
      "UPDATE links SET created = created + 1 WHERE name = 'Desk'",
      "UPDATE links SET restoration = 'x'",
      "UPDATE links SET restoration = id",
      "INSERT OR IGNORE INTO received SELECT scene_hash, x'00' FROM links",
      "DROP TABLE received; CREATE VIEW received AS SELECT 'x' AS hash, x'00' AS data",
      "CREATE TRIGGER t AFTER INSERT ON received BEGIN DELETE FROM links; END"};
  for (std::size_t i = 0; i < attacks.size(); ++i) {
    SCOPED_TRACE(attacks[i]);
    const std::string copy = "copy" + std::to_string(i);
    const std::filesystem::path state = SyncStatePath(folder_ / copy);
    std::filesystem::copy_file(folder_ / "a", folder_ / copy);
    std::filesystem::copy_file(SyncStatePath(folder_ / "a"), state);
    if (attacks[i].empty()) {
      std::ofstream(state, std::ios::trunc) << "This is no database.";
    } else {
      const maps::Database database = maps::Database::OpenReadWrite(state, false);
      database.Execute(attacks[i].c_str());
    }
    ErrorOf([&] { Pull(SampleSync(Url(), folder_ / copy)); });
    EXPECT_THAT(AllTexts(copy), HasSubstr("mine"));
    // Its owner moves it away, as the sentence says.
    for (const char* suffix : {"", "-wal", "-shm"}) std::filesystem::remove(state.string() + suffix);
    EXPECT_EQ(ErrorOf([&] { Pull(SampleSync(Url(), folder_ / copy)); }), "");
    EXPECT_THAT(AllTexts(copy), testing::AllOf(HasSubstr("mine"), HasSubstr("theirs")));
  }
}

TEST_F(HubState, AColumnWithAnotherKeyThanThoseOfAHubIsRefused) {
  std::uint64_t key = 0;
  {
    Library a = OpenSampleLibrary(folder_ / "a");
    key = AddSampleMap(&a, "Desk", 7);
  }
  LocalMap map = LocalLibrary(folder_ / "a", CreateIfMissing::kNo, {}).Read(key, {});
  LocalLibrary device(folder_ / "b", CreateIfMissing::kYes, {});
  map.facts.info.key = device.library().NewKey();
  LocalMap other = map;
  other.items["points"] = WithKey(other.items["points"], 9);
  EXPECT_THROW(device.Write(other, {}, ""), Error);
  EXPECT_EQ(device.StampOf(map.facts.info.key), "");
  device.Write(map, {}, "");
  EXPECT_EQ(device.Read(map.facts.info.key, {}).manifest, map.manifest);
}

TEST_F(HubState, FactsThatDoNotFitAKnownStructureAreRefused) {
  std::uint64_t key = 0;
  {
    Library a = OpenSampleLibrary(folder_ / "a");
    key = AddSampleMap(&a, "Desk", 7);
  }
  LocalMap map = LocalLibrary(folder_ / "a", CreateIfMissing::kNo, {}).Read(key, {});
  LocalLibrary device(folder_ / "b", CreateIfMissing::kYes, {});
  key = map.facts.info.key = device.library().NewKey();
  const LocalState written = device.Write(map, {}, "");
  EXPECT_EQ(written.stamp, device.StampOf(key));
  EXPECT_EQ(device.Read(key, {}).state.stamp, written.stamp);
  EXPECT_EQ(device.Read(key, {}).state.scene_hash, written.scene_hash);
  const std::vector<std::function<void(MapInfo*)>> attacks = {
      [](MapInfo* info) { ++info->keyframes; }, [](MapInfo* info) { ++info->points; },
      [](MapInfo* info) { ++info->observations; }, [](MapInfo* info) { info->next_keyframe = 0; },
      [](MapInfo* info) { info->next_point = 0; }};
  for (std::size_t i = 0; i < attacks.size(); ++i) {
    SCOPED_TRACE(i);
    LocalMap other = map;
    attacks[i](&other.facts.info);
    EXPECT_THROW(device.Write(other, {}, written.stamp), Error);
    EXPECT_EQ(device.StampOf(key), written.stamp);
    EXPECT_EQ(ErrorOf([&] { device.library().Load(key); }), "");
  }
}

TEST_F(HubState, AFileBesideANewLibraryIsNotUsed) {
  {
    Library a = OpenSampleLibrary(folder_ / "a");
    AddSampleMap(&a, "Desk", 7);
    AddSampleMap(&a, "Hall", 8);
  }
  Push(SampleSync(Url(), folder_ / "a"));
  // Each new library has given out fewer keys than the old one, or the same keys to other maps; a file of an
  // older program does not name its library.
  std::filesystem::copy_file(SyncStatePath(folder_ / "a"), folder_ / "older");
  maps::Database::OpenReadWrite(folder_ / "older", false).Execute("UPDATE hub SET library = ''");
  for (const std::uint64_t maps : {0u, 1u, 2u, 3u}) {
    SCOPED_TRACE(maps);
    const std::string name = "new" + std::to_string(maps);
    std::filesystem::copy_file(maps == 0 || maps == 3 ? SyncStatePath(folder_ / "a") : folder_ / "older",
                               SyncStatePath(folder_ / name));
    {
      Library library = OpenSampleLibrary(folder_ / name);
      for (std::uint64_t i = 0; i < maps; ++i)
        AddSampleMap(&library, name + " " + std::to_string(i), 10 * maps + i);
    }
    SyncOptions options = SampleSync(Url(), folder_ / name);
    options.remove = true;
    const SyncReport report = Push(options);
    EXPECT_THAT(LinesOf(report), HasSubstr("was written for another library"));
    EXPECT_EQ(report.problems, 0);
    EXPECT_THAT(Push(options).lines, IsEmpty()) << "it is told once";
  }
  Pull(SampleSync(Url(), folder_ / "new2"));
  const std::string all = "Desk,Hall,new1 0,new2 0,new2 1,new3 0,new3 1,new3 2";
  EXPECT_EQ(NamesIn(OpenSampleLibrary(folder_ / "new2")), all);
  EXPECT_EQ(DifferenceOf("Desk", folder_ / "a", folder_ / "new2"), "");
  EXPECT_EQ(Pull(SampleSync(Url(), folder_ / "a")).problems, 0);
  EXPECT_EQ(NamesIn(OpenSampleLibrary(folder_ / "a")), all);
}

TEST_F(HubState, AFileBesideAnOlderCopyOfItsLibraryIsNotUsed) {
  const std::filesystem::path file = folder_ / "a", copy = folder_ / "copy";
  {
    Library a = OpenSampleLibrary(file);
    AddSampleMap(&a, "Desk", 7);
  }
  Push(SampleSync(Url(), file));
  std::filesystem::copy_file(file, copy);
  AddSign("a", "sign-2", "newer");
  {
    Library a = OpenSampleLibrary(file);
    AddSampleMap(&a, "Foo", 8);
  }
  Push(SampleSync(Url(), file));
  std::filesystem::copy_file(copy, file, std::filesystem::copy_options::overwrite_existing);
  {
    Library a = OpenSampleLibrary(file);
    AddSampleMap(&a, "Bar", 9);  // With the key that Foo had.
  }
  EXPECT_THAT(LinesOf(Push(SampleSync(Url(), file))), HasSubstr("or for a newer state of it"));
  EXPECT_EQ(Pull(SampleSync(Url(), file)).problems, 0);
  Pull(SampleSync(Url(), folder_ / "b"));
  // What differs is kept twice.
  EXPECT_EQ(NamesIn(OpenSampleLibrary(folder_ / "b")), "Bar,Desk,Desk (2),Foo");
  EXPECT_EQ(NamesIn(OpenSampleLibrary(file)), "Bar,Desk,Desk (2),Foo");
  EXPECT_THAT(AllTexts("b"), HasSubstr("newer")) << "the older copy does not count as a change";
  EXPECT_THAT(AllTexts("a"), HasSubstr("newer"));
  EXPECT_THAT(Push(SampleSync(Url(), file)).lines, IsEmpty()) << "it is told once";
}

TEST_F(HubState, AFileBesideANewLibraryThatHasOnlyReservedKeysRemovesNothing) {
  {
    Library a = OpenSampleLibrary(folder_ / "a");
    AddSampleMap(&a, "Desk", 7);
    AddSampleMap(&a, "Hall", 8);
  }
  Push(SampleSync(Url(), folder_ / "a"));
  // As an author's session does that ends without a map.
  for (const char* name : {"new", "pulled"}) {
    std::filesystem::copy_file(SyncStatePath(folder_ / "a"), SyncStatePath(folder_ / name));
    OpenSampleLibrary(folder_ / name).ReserveKeys(64);
  }
  SyncOptions options = SampleSync(Url(), folder_ / "new");
  options.remove = true;
  EXPECT_THAT(LinesOf(Push(options)), HasSubstr("was written for another library"));
  EXPECT_THAT(LinesOf(Pull(SampleSync(Url(), folder_ / "pulled"))), HasSubstr("'Hall' was added"));
  EXPECT_EQ(NamesIn(OpenSampleLibrary(folder_ / "pulled")), "Desk,Hall");
  // What was removed from the library with the file is still removed from the hub.
  {
    Library library = OpenSampleLibrary(folder_ / "pulled");
    for (const MapInfo& info : library.List()) library.Remove(info.key);
  }
  options.library = folder_ / "pulled";
  EXPECT_THAT(LinesOf(Push(options)), HasSubstr("'Desk' was removed from the hub"));
}

TEST_F(HubState, AMapThatTwoDevicesImportedKeepsItsLinkWhenAPullIsKilled) {
  for (const char* device : {"a", "b"}) {
    Library library = OpenSampleLibrary(folder_ / device);
    AddSampleMap(&library, "Desk", 7);
  }
  Push(SampleSync(Url(), folder_ / "a"));
  ASSERT_THAT(LinesOf(Push(SampleSync(Url(), folder_ / "b"))), HasSubstr("the same map as on the hub"));
  AddSign("a", "sign-2", "theirs");
  Push(SampleSync(Url(), folder_ / "a"));
  // After the kill, the library has the map and the time at which `a` created it, and the file the old link.
  const std::filesystem::path state = SyncStatePath(folder_ / "b"), before = folder_ / "before";
  std::filesystem::copy_file(state, before);
  ASSERT_THAT(LinesOf(Pull(SampleSync(Url(), folder_ / "b"))), HasSubstr("was updated to revision 2"));
  std::filesystem::copy_file(before, state, std::filesystem::copy_options::overwrite_existing);
  EXPECT_THAT(Pull(SampleSync(Url(), folder_ / "b")).lines, IsEmpty());
}

TEST_F(HubState, AFileOfAnOlderProgramIsUsed) {
  {
    Library a = OpenSampleLibrary(folder_ / "a");
    AddSampleMap(&a, "Desk", 7);
  }
  Push(SampleSync(Url(), folder_ / "a"));
  const std::filesystem::path state = SyncStatePath(folder_ / "a");
  {
    const maps::Database database = maps::Database::OpenReadWrite(state, false);
    for (const char* sql :
         {"ALTER TABLE links DROP COLUMN created", "ALTER TABLE links DROP COLUMN restoration",
          "ALTER TABLE tours DROP COLUMN restoration", "ALTER TABLE hub DROP COLUMN library"})
      database.Execute(sql);
  }
  EXPECT_THAT(Push(SampleSync(Url(), folder_ / "a")).lines, IsEmpty());
  EXPECT_EQ(maps::Database::OpenReadWrite(state, false).Number("SELECT length(library) FROM hub"), 36)
      << "it knows its library from now on";
}

}  // namespace
}  // namespace docent::maps

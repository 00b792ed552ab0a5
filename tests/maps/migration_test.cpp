// SPDX-License-Identifier: Apache-2.0
#include "maps/migration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include "maps/library.h"
#include "maps/schema.h"
#include "maps/thumbnail_rows.h"
#include "tests/maps/failing_disk.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::HasSubstr;

void RunSql(const std::filesystem::path& file, const std::string& sql) {
  sqlite3* connection = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &connection), SQLITE_OK);
  char* message = nullptr;
  EXPECT_EQ(sqlite3_exec(connection, sql.c_str(), nullptr, nullptr, &message), SQLITE_OK) << message;
  sqlite3_free(message);
  sqlite3_close(connection);
}

Library Open(const std::filesystem::path& file, Access access) {
  return Library::Open(file, access, CreateIfMissing::kNo, QuickOptions());
}

std::vector<std::vector<KeyFrameThumbnail>> ThumbnailsIn(const Library& library) {
  std::vector<std::vector<KeyFrameThumbnail>> all;
  library.LoadThumbnails(
      [&](const MapInfo&, std::vector<KeyFrameThumbnail> thumbnails, const std::string& problem) {
        EXPECT_EQ(problem, "");
        all.push_back(std::move(thumbnails));
      });
  return all;
}

// A library as the first released version wrote it: its tables, by its own words, and two maps in them.
class Migration : public ::testing::Test {
 protected:
  Migration() {
    const auto newer = folder_ / "newer.docent";
    {
      Library library = Library::Open(newer, Access::kReadWrite, CreateIfMissing::kYes, QuickOptions());
      library.Save({library.NewKey(), "Desk", Policy::kOpen, desk_, scene_});
      library.Save({library.NewKey(), "Door", Policy::kReadOnly, door_, nullptr});
      thumbnails_ = ThumbnailsIn(library);
    }
    RunSql(file_, R"sql(
      CREATE TABLE library (id INTEGER PRIMARY KEY CHECK (id = 1), next_key INTEGER NOT NULL, map_count INTEGER NOT NULL, checksum INTEGER NOT NULL) STRICT;
      CREATE TABLE maps (key INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, policy TEXT NOT NULL, created_ns INTEGER NOT NULL, modified_ns INTEGER NOT NULL, revision INTEGER NOT NULL, next_keyframe INTEGER NOT NULL, next_point INTEGER NOT NULL, keyframe_count INTEGER NOT NULL, point_count INTEGER NOT NULL, observation_count INTEGER NOT NULL, bounds BLOB, checksum INTEGER NOT NULL) STRICT;
      CREATE TABLE parts (map_key INTEGER NOT NULL, part TEXT NOT NULL, data BLOB NOT NULL, PRIMARY KEY (map_key, part)) STRICT;
      CREATE TABLE pictures (map_key INTEGER NOT NULL, keyframe INTEGER NOT NULL, data BLOB NOT NULL, PRIMARY KEY (map_key, keyframe)) STRICT;
      CREATE TABLE assets (id TEXT PRIMARY KEY, name TEXT NOT NULL, data BLOB NOT NULL, checksum INTEGER NOT NULL) STRICT;
      PRAGMA application_id = 1148150644;
      PRAGMA user_version = 1;
      ATTACH ')sql" + newer.string() +
                      R"sql(' AS newer;
      INSERT INTO library SELECT * FROM newer.library;
      INSERT INTO maps SELECT * FROM newer.maps;
      INSERT INTO parts SELECT * FROM newer.parts WHERE part != 'panoramas';
      INSERT INTO pictures SELECT * FROM newer.pictures;
      INSERT INTO assets SELECT * FROM newer.assets;)sql");
    std::filesystem::remove(newer);
  }
  void ExpectAllThere(const Library& library) const {
    EXPECT_EQ(library.Verify(), std::vector<std::string>{});
    EXPECT_EQ(FirstDifference(*library.Load(1).snapshot, *desk_), "");
    EXPECT_EQ(FirstDifference(library.Load(1).scene, *scene_), "");
    EXPECT_EQ(FirstDifference(*library.Load(2).snapshot, *door_), "");
    EXPECT_EQ(library.Find(2).policy, Policy::kReadOnly);
    EXPECT_EQ(ThumbnailsIn(library), thumbnails_);
  }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "a.docent";
  // Nothing that the first format did not know.
  static std::shared_ptr<engine::MapSnapshot> WithoutPanoramas(std::shared_ptr<engine::MapSnapshot> map) {
    map->panoramas.clear();
    map->next_panorama = 0;
    for (auto& keyframe : map->keyframes) keyframe.panorama = engine::kNoId;
    for (auto& point : map->points) {
      point.point_in_map[3] = 1;
      point.panorama = engine::kNoId;
      point.was_infinite = false;
    }
    return map;
  }
  std::shared_ptr<engine::MapSnapshot> desk_ =
      WithoutPanoramas(MakeSampleMap(1, {.keyframes = 2, .points = 30}));
  std::shared_ptr<engine::MapSnapshot> door_ =
      WithoutPanoramas(MakeSampleMap(2, {.keyframes = 3, .points = 60}));
  std::shared_ptr<SceneRecord> scene_ = MakeSampleScene(3, 1);
  std::vector<std::vector<KeyFrameThumbnail>> thumbnails_;
};

TEST_F(Migration, AVisitorReadsTheFirstFormatAndLeavesItAsItIs) {
  const Bytes before = ReadWholeFile(file_);
  ExpectAllThere(Open(file_, Access::kReadOnly));
  EXPECT_EQ(ReadWholeFile(file_), before);
  EXPECT_EQ(FilesIn(folder_.path()), "a.docent");
}

TEST_F(Migration, AnAuthorUpgradesTheFirstFormatAndKeepsACopyOfIt) {
  const Bytes before = ReadWholeFile(file_);
  { ExpectAllThere(Open(file_, Access::kReadWrite)); }
  EXPECT_EQ(FilesIn(folder_.path()), "a.docent a.docent.format-1");
  ExpectAllThere(Open(file_, Access::kReadOnly));
  // The copy is a library in itself, of the first format.
  ExpectAllThere(Open(folder_ / "a.docent.format-1", Access::kReadOnly));
  const Bytes copy = ReadWholeFile(folder_ / "a.docent.format-1");
  // The second time there is nothing to do.
  Open(file_, Access::kReadWrite).Rename(1, "Table");
  EXPECT_EQ(ReadWholeFile(folder_ / "a.docent.format-1"), copy);
  EXPECT_EQ(Open(file_, Access::kReadOnly).Find(1).name, "Table");
  EXPECT_EQ(Open(folder_ / "a.docent.format-1", Access::kReadOnly).Find(1).name, "Desk");
}

TEST_F(Migration, ADamagedMapStopsTheUpgradeAndTheLibraryStaysAsItWas) {
  RunSql(file_, "DELETE FROM pictures WHERE map_key = 2 AND keyframe = 1");
  EXPECT_THAT(ErrorOf([&] { Open(file_, Access::kReadWrite); }),
              HasSubstr("map 'Door' (2): the picture of keyframe 1"));
  const Library library = Open(file_, Access::kReadOnly);
  EXPECT_EQ(FirstDifference(*library.Load(1).snapshot, *desk_), "");
}

TEST_F(Migration, WithoutRoomForACopyNothingIsUpgraded) {
  const Bytes before = ReadWholeFile(file_);
  std::filesystem::create_directory(folder_ / "a.docent.format-1.part");  // something in the copy's way
  WriteWholeFile(folder_ / "a.docent.format-1.part/x", before);
  EXPECT_THAT(ErrorOf([&] { Open(file_, Access::kReadWrite); }),
              HasSubstr("no copy of it can be made beside it"));
  ExpectAllThere(Open(file_, Access::kReadOnly));
}

TEST_F(Migration, ADiskThatFillsUpAtAnyWriteLosesNothing) {
  const Bytes before = ReadWholeFile(file_);
  int failures = 0;
  for (int writes = 0; writes < 90; writes += 6) {
    std::filesystem::remove(folder_ / "a.docent.format-1");
    WriteWholeFile(file_, before);
    {
      FailingDisk disk;
      disk.FailAfter(writes);
      const std::string error = ErrorOf([&] { Open(file_, Access::kReadWrite); });
      if (error != "no error") {
        ++failures;
        EXPECT_THAT(error, HasSubstr("the disk is full"));
        EXPECT_EQ(error.find('\n'), std::string::npos);
      }
    }
    ExpectAllThere(Open(file_, Access::kReadOnly));
    ExpectAllThere(Open(file_, Access::kReadWrite));
    ExpectAllThere(Open(folder_ / "a.docent.format-1", Access::kReadOnly));
    EXPECT_EQ(FilesIn(folder_.path()), "a.docent a.docent.format-1");
  }
  EXPECT_GT(failures, 3) << "the disk was never full";
}

TEST(Thumbnails, AreThoseOfTheKeyframesAfterEverySave) {
  const TemporaryFolder folder;
  Library library =
      Library::Open(folder / "a.docent", Access::kReadWrite, CreateIfMissing::kYes, QuickOptions());
  const std::uint64_t key = library.NewKey();
  auto map = MakeSampleMap(1, {.keyframes = 3});
  library.Save({key, "Desk", Policy::kOpen, map, nullptr});
  EXPECT_EQ(ThumbnailsIn(library).at(0), MakeThumbnails(*map));
  AddSampleKeyFrame(9, {1, 0, 0}, map.get());
  library.Save({key, "Desk", Policy::kOpen, map, nullptr});
  EXPECT_EQ(ThumbnailsIn(library).at(0), MakeThumbnails(*map));
  EXPECT_EQ(MakeThumbnails(*map).size(), 4u);
  EXPECT_EQ(library.Verify(), std::vector<std::string>{});
}

TEST(Thumbnails, ThatAreDamagedAreToldAndTheOthersHandedOut) {
  const TemporaryFolder folder;
  {
    Library library =
        Library::Open(folder / "a.docent", Access::kReadWrite, CreateIfMissing::kYes, QuickOptions());
    library.Save({library.NewKey(), "Desk", Policy::kOpen, MakeSampleMap(1), nullptr});
    library.Save({library.NewKey(), "Door", Policy::kOpen, MakeSampleMap(2), nullptr});
  }
  RunSql(folder / "a.docent", "UPDATE thumbnails SET data = x'00' WHERE map_key = 1");
  std::string problems;
  std::size_t keyframes = 0;
  Open(folder / "a.docent", Access::kReadOnly)
      .LoadThumbnails(
          [&](const MapInfo& info, std::vector<KeyFrameThumbnail> thumbnails, const std::string& problem) {
            problems += problem;
            keyframes += thumbnails.size();
            EXPECT_EQ(thumbnails.empty(), info.name == "Desk");
          });
  EXPECT_THAT(problems, HasSubstr("map 'Desk' (1): the table of thumbnails is cut off"));
  EXPECT_EQ(keyframes, 3u);
}

}  // namespace
}  // namespace docent::maps

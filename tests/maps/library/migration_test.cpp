// SPDX-License-Identifier: Apache-2.0
#include "maps/library/migration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "maps/index/thumbnail_rows.h"
#include "maps/index/word_rows.h"
#include "maps/library/library.h"
#include "maps/storage/schema.h"
#include "tests/maps/failing_disk.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::HasSubstr;

Library Open(const std::filesystem::path& file, Access access) {
  return Library::Open(file, access, CreateIfMissing::kNo, QuickOptions());
}

std::vector<std::vector<engine::KeyFrameThumbnail>> ThumbnailsIn(const Library& library) {
  std::vector<std::vector<engine::KeyFrameThumbnail>> all;
  library.LoadAppearance([&](const MapInfo&, Library::Appearance appearance) {
    EXPECT_EQ(appearance.problem, "");
    all.push_back(std::move(appearance.thumbnails));
  });
  return all;
}

std::vector<std::vector<engine::KeyFrameWords>> WordsByMap(const Library& library) {
  std::vector<std::vector<engine::KeyFrameWords>> all;
  library.LoadAppearance([&](const MapInfo&, Library::Appearance appearance) {
    EXPECT_EQ(appearance.problem, "");
    all.push_back(std::move(appearance.words));
  });
  return all;
}

// A library as an earlier version wrote it: the tables of that format, and two maps in them.
class Migration : public ::testing::TestWithParam<int> {
 protected:
  Migration() {
    const auto newer = folder_ / "newer.docent";
    {
      Library library = OpenToWrite(newer);
      library.Save({library.NewKey(), "Desk", Policy::kOpen, desk_, scene_});
      library.Save({library.NewKey(), "Door", Policy::kReadOnly, door_, nullptr});
      thumbnails_ = ThumbnailsIn(library);
      words_ = WordsByMap(library);
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
      INSERT INTO parts SELECT * FROM newer.parts WHERE part != 'panoramas' AND part NOT LIKE '%.blocks';
      INSERT INTO pictures SELECT * FROM newer.pictures;
      INSERT INTO assets SELECT * FROM newer.assets;)sql");
    if (GetParam() >= 2) {
      RunSql(file_, R"sql(
      CREATE TABLE thumbnails (map_key INTEGER PRIMARY KEY, data BLOB NOT NULL) STRICT;
      PRAGMA user_version = 2;
      ATTACH ')sql" + newer.string() +
                        R"sql(' AS newer;
      INSERT INTO parts SELECT * FROM newer.parts WHERE part = 'panoramas';
      INSERT INTO thumbnails SELECT * FROM newer.thumbnails;)sql");
    }
    if (GetParam() >= 3) {
      RunSql(file_, R"sql(
      CREATE TABLE words (map_key INTEGER PRIMARY KEY, data BLOB NOT NULL) STRICT;
      PRAGMA user_version = 3;
      ATTACH ')sql" + newer.string() +
                        R"sql(' AS newer;
      INSERT INTO words SELECT * FROM newer.words;)sql");
    }
    if (GetParam() >= 4) {
      RunSql(file_, R"sql(
      CREATE TABLE lenses (camera TEXT PRIMARY KEY, data BLOB NOT NULL, checksum INTEGER NOT NULL) STRICT;
      PRAGMA user_version = 4;)sql");
    }
    if (GetParam() >= 5) {
      RunSql(file_, R"sql(
      PRAGMA user_version = 5;
      ATTACH ')sql" + newer.string() +
                        R"sql(' AS newer;
      INSERT INTO parts SELECT * FROM newer.parts WHERE part LIKE '%.blocks';)sql");
    }
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
  void ExpectUpgraded(const Library& library) const {
    ExpectAllThere(library);
    EXPECT_EQ(WordsByMap(library), words_);
    EXPECT_THAT(library.Tours(), ::testing::IsEmpty());
  }
  std::string CopyName() const { return "a.docent.format-" + std::to_string(GetParam()); }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "a.docent";
  // Removes what format 1 did not have.
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
  std::shared_ptr<engine::MapSnapshot> desk_ = WithoutPanoramas(
      MakeSampleMap(1, {.keyframes = 2, .points = 30, .width_px = 160, .height_px = 128, .corners = true}));
  std::shared_ptr<engine::MapSnapshot> door_ = WithoutPanoramas(
      MakeSampleMap(2, {.keyframes = 3, .points = 60, .width_px = 160, .height_px = 128, .corners = true}));
  std::shared_ptr<SceneRecord> scene_ = MakeSampleScene(3, 1);
  std::vector<std::vector<engine::KeyFrameThumbnail>> thumbnails_;
  std::vector<std::vector<engine::KeyFrameWords>> words_;
};
INSTANTIATE_TEST_SUITE_P(EachFormat, Migration, ::testing::Values(1, 2, 3, 4, 5));

TEST_P(Migration, AVisitorReadsAnEarlierFormatWithoutChangingIt) {
  const Bytes before = ReadWholeFile(file_);
  const Library library = Open(file_, Access::kReadOnly);
  ExpectAllThere(library);
  const auto none = std::vector<std::vector<engine::KeyFrameWords>>(2);
  EXPECT_EQ(WordsByMap(library), GetParam() < 3 ? none : words_);
  EXPECT_THAT(library.Lenses(), ::testing::IsEmpty());
  EXPECT_THAT(library.Tours(), ::testing::IsEmpty());
  EXPECT_EQ(ReadWholeFile(file_), before);
  EXPECT_EQ(FilesIn(folder_.path()), "a.docent");
}

TEST_P(Migration, AnAuthorUpgradesAnEarlierFormatAndKeepsACopyOfIt) {
  ASSERT_FALSE(words_.at(0).at(0).words.empty()) << "without words the test is void";
  { ExpectUpgraded(Open(file_, Access::kReadWrite)); }
  EXPECT_EQ(FilesIn(folder_.path()), "a.docent " + CopyName());
  ExpectUpgraded(Open(file_, Access::kReadOnly));
  // The copy is itself a library of that format.
  ExpectAllThere(Open(folder_ / CopyName(), Access::kReadOnly));
  const Bytes copy = ReadWholeFile(folder_ / CopyName());
  // The second time there is nothing to do.
  Open(file_, Access::kReadWrite).Rename(1, "Table");
  EXPECT_EQ(ReadWholeFile(folder_ / CopyName()), copy);
  EXPECT_EQ(Open(file_, Access::kReadOnly).Find(1).name, "Table");
  EXPECT_EQ(Open(folder_ / CopyName(), Access::kReadOnly).Find(1).name, "Desk");
}

TEST_P(Migration, AnUpgradedLibraryTakesTours) {
  {
    Library library = Open(file_, Access::kReadWrite);
    library.ChangeTours([](std::vector<Tour>* tours) { tours->push_back({"All", {2, 1}, "de", 20}); });
  }
  EXPECT_THAT(Open(file_, Access::kReadOnly).Tours(), ::testing::ElementsAre(Tour{"All", {2, 1}, "de", 20}));
  EXPECT_EQ(Open(file_, Access::kReadOnly).Verify(), std::vector<std::string>{});
}

TEST_P(Migration, SignpostsGetTheKeysOfTheirMapsAndMayLeadNowhere) {
  { Open(file_, Access::kReadWrite); }
  const std::string copy = (folder_ / CopyName()).string();
  std::filesystem::remove(copy);
  // The upgraded library is given back its older format, with a scene of that time.
  Library::Open(file_, Access::kReadWrite, CreateIfMissing::kNo, QuickOptions())
      .Save({1, "", Policy::kOpen, nullptr, MakeTextScene("sign a 0 Door\nsign b 0 Gone")});
  RunSql(file_, "DELETE FROM parts WHERE part LIKE '%.blocks'; DROP TABLE tours; PRAGMA user_version = 4");
  const Library library = Open(file_, Access::kReadWrite);
  EXPECT_EQ(library.LoadScene(1).text, "sign a 2 Door\nsign b 0 Gone");
  EXPECT_EQ(library.Verify(), std::vector<std::string>{});
  EXPECT_THAT(library.SignpostsToNoMap(),
              ::testing::ElementsAre(HasSubstr("the signpost 'b' leads to the map 'Gone'")));
}

TEST_P(Migration, ADamagedMapStopsTheUpgradeWithoutChanges) {
  // An upgrade from format 3 does not read images.
  if (GetParam() >= 3) GTEST_SKIP();
  RunSql(file_, "DELETE FROM pictures WHERE map_key = 2 AND keyframe = 1");
  EXPECT_THAT(ErrorOf([&] { Open(file_, Access::kReadWrite); }),
              HasSubstr("map 'Door' (2): the image of keyframe 1"));
  const Library library = Open(file_, Access::kReadOnly);
  EXPECT_EQ(FirstDifference(*library.Load(1).snapshot, *desk_), "");
}

TEST_P(Migration, NothingIsUpgradedWhenTheCopyCannotBeMade) {
  const Bytes before = ReadWholeFile(file_);
  const auto unfinished = folder_ / (CopyName() + ".part");
  std::filesystem::create_directory(unfinished);  // It blocks the copy's path.
  WriteWholeFile(unfinished / "x", before);
  EXPECT_THAT(ErrorOf([&] { Open(file_, Access::kReadWrite); }),
              HasSubstr("no copy of it can be made beside it"));
  ExpectAllThere(Open(file_, Access::kReadOnly));
}

TEST_P(Migration, AFullDiskAtAnyWriteLosesNothing) {
  const Bytes before = ReadWholeFile(file_);
  int failures = 0;
  for (int writes = 0; writes < 90; writes += 6) {
    std::filesystem::remove(folder_ / CopyName());
    WriteWholeFile(file_, before);
    {
      FailingDisk disk;
      disk.FailAfter(writes);
      const std::string error = ErrorOf([&] { Open(file_, Access::kReadWrite); });
      if (!error.empty()) {
        ++failures;
        EXPECT_THAT(error, HasSubstr("the disk is full"));
        EXPECT_EQ(error.find('\n'), std::string::npos);
      }
    }
    ExpectAllThere(Open(file_, Access::kReadOnly));
    ExpectUpgraded(Open(file_, Access::kReadWrite));
    ExpectAllThere(Open(folder_ / CopyName(), Access::kReadOnly));
    EXPECT_EQ(FilesIn(folder_.path()), "a.docent " + CopyName());
  }
  EXPECT_GT(failures, 3) << "the disk was never full";
}

TEST(Thumbnails, MatchTheKeyframesAfterEverySave) {
  const TemporaryFolder folder;
  Library library = OpenToWrite(folder / "a.docent");
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

TEST(Thumbnails, DamagedOnesAreReportedAndTheOthersLoaded) {
  const TemporaryFolder folder;
  {
    Library library = OpenToWrite(folder / "a.docent");
    library.Save({library.NewKey(), "Desk", Policy::kOpen, MakeSampleMap(1), nullptr});
    library.Save({library.NewKey(), "Door", Policy::kOpen, MakeSampleMap(2), nullptr});
  }
  RunSql(folder / "a.docent", "UPDATE thumbnails SET data = x'00' WHERE map_key = 1");
  std::string problems;
  std::size_t keyframes = 0, words = 0;
  Open(folder / "a.docent", Access::kReadOnly)
      .LoadAppearance([&](const MapInfo& info, const Library::Appearance& appearance) {
        problems += appearance.problem;
        keyframes += appearance.thumbnails.size();
        words += appearance.words.size();
        EXPECT_EQ(appearance.thumbnails.empty(), info.name == "Desk");
      });
  EXPECT_THAT(problems, HasSubstr("map 'Desk' (1): the table of thumbnails is cut off"));
  EXPECT_EQ(keyframes, 3u);
  EXPECT_EQ(words, 6u);
}

}  // namespace
}  // namespace docent::maps

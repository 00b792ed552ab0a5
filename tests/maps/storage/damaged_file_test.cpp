// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/damaged_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "engine/base/random.h"
#include "maps/library/library.h"
#include "maps/storage/database.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

// A library with three maps, one of which was removed, in pages of the parameter's size.
class PagesOfEachSize : public ::testing::TestWithParam<int> {
 protected:
  PagesOfEachSize() {
    {
      Library library = OpenToWrite(file_);
      for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        library.Save({library.NewKey(), "map " + std::to_string(seed), Policy::kOpen,
                      MakeSampleMap(seed, {.keyframes = 5, .points = 300}), MakeSampleScene(seed * 10, 2)});
      }
    }
    RunSql(file_, "PRAGMA page_size = " + std::to_string(GetParam()) + "; VACUUM");
    Library library = OpenToWrite(file_);
    library.Remove(2);
    library.ChangeTours([](std::vector<Tour>* tours) { tours->push_back({"All", {3, 1}, "de", 20}); });
  }
  // The data of all rows by what they are found by, as SQLite reads them.
  std::vector<std::pair<std::string, Bytes>> RowsBySqlite(const std::string& sql) const {
    std::vector<std::pair<std::string, Bytes>> rows;
    const Database database = Database::OpenReadOnly(file_);
    Statement query = database.Prepare(sql);
    while (query.Step()) rows.emplace_back(query.Text(0), Bytes(query.Blob(1).begin(), query.Blob(1).end()));
    std::sort(rows.begin(), rows.end());
    return rows;
  }
  static std::vector<std::pair<std::string, Bytes>> RowsByPages(const DamagedFile& file, SalvagedTable table,
                                                                std::size_t data_column) {
    std::vector<std::pair<std::string, Bytes>> rows;
    for (const RowPlace& place : file.rows(table)) {
      if (place.found != RowPlace::Page::kReached) continue;
      const auto row = file.Read(place);
      EXPECT_TRUE(row && row->whole);
      const std::string id = table == SalvagedTable::kImages
                                 ? std::to_string(place.key) + " " + std::to_string(place.keyframe)
                             : table == SalvagedTable::kParts ? std::to_string(place.key) + " " + place.name
                                                              : place.name;
      rows.emplace_back(id, row->values[data_column].bytes);
    }
    std::sort(rows.begin(), rows.end());
    return rows;
  }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "a.docent";
};
INSTANTIATE_TEST_SUITE_P(Bytes, PagesOfEachSize, ::testing::Values(512, 1024, 4096, 65536));

TEST_P(PagesOfEachSize, HaveTheRowsThatSqliteReads) {
  const DamagedFile file(file_);
  EXPECT_EQ(file.application_id(), 0x446F6374u);
  EXPECT_EQ(file.format(), 6u);
  for (std::size_t table = 0; table < kSalvagedTables; ++table)
    EXPECT_TRUE(file.complete(static_cast<SalvagedTable>(table))) << table;
  const auto parts = RowsBySqlite("SELECT map_key || ' ' || part, data FROM parts");
  EXPECT_EQ(RowsByPages(file, SalvagedTable::kParts, 2), parts);
  EXPECT_EQ(parts.size(), 2u * 9);
  const auto images = RowsBySqlite("SELECT map_key || ' ' || keyframe, data FROM pictures");
  EXPECT_EQ(RowsByPages(file, SalvagedTable::kImages, 2), images);
  EXPECT_EQ(images.size(), 10u);
  const auto assets = RowsBySqlite("SELECT id, data FROM assets");
  EXPECT_EQ(RowsByPages(file, SalvagedTable::kAssets, 2), assets);
  EXPECT_EQ(assets.size(), 4u);
  const auto tours = RowsBySqlite("SELECT name, stops FROM tours");
  EXPECT_EQ(RowsByPages(file, SalvagedTable::kTours, 3), tours);
  EXPECT_EQ(tours.size(), 1u);
  std::vector<std::uint64_t> keys;
  for (const RowPlace& place : file.rows(SalvagedTable::kMaps)) {
    if (place.found == RowPlace::Page::kReached) keys.push_back(place.key);
  }
  EXPECT_THAT(keys, ::testing::ElementsAre(1, 3));
}

TEST_P(PagesOfEachSize, AreReadToTheEndWhateverTheyHold) {
  const Bytes intact = ReadWholeFile(file_);
  Random random(static_cast<std::uint64_t>(GetParam()));
  std::size_t rows = 0;
  for (int round = 0; round < 60; ++round) {
    Bytes damaged = intact;
    // Half of the changes are in the heads of pages.
    for (int i = 0; i < 200; ++i) {
      const auto size = static_cast<std::uint32_t>(damaged.size());
      const std::size_t at =
          i % 2 == 0 ? random.Below(size) / GetParam() * GetParam() + random.Below(40) : random.Below(size);
      damaged[std::min(at, damaged.size() - 1)] = static_cast<std::uint8_t>(random.Next());
    }
    if (round % 4 == 0) damaged.resize(random.Below(static_cast<std::uint32_t>(damaged.size())));
    WriteWholeFile(file_, damaged);
    const DamagedFile file(file_);
    for (std::size_t table = 0; table < kSalvagedTables; ++table) {
      for (const RowPlace& place : file.rows(static_cast<SalvagedTable>(table)))
        rows += file.Read(place) ? 1 : 0;
    }
  }
  EXPECT_GT(rows, 100u) << "the damage left nothing to read";
}

TEST_P(PagesOfEachSize, HaveTheirRowsWithoutTheFirstPage) {
  if (GetParam() != 4096)
    GTEST_SKIP() << "without a header, pages have the size that libraries are made with";
  Bytes bytes = ReadWholeFile(file_);
  std::fill_n(bytes.begin(), 4096, std::uint8_t{0});
  WriteWholeFile(file_, bytes);
  const DamagedFile file(file_);
  EXPECT_FALSE(file.complete(SalvagedTable::kParts));
  std::size_t parts = 0;
  for (const RowPlace& place : file.rows(SalvagedTable::kParts)) parts += place.key != 2 ? 1 : 0;
  EXPECT_GE(parts, 18u);
}

}  // namespace
}  // namespace docent::maps

// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/tour_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "engine/base/error.h"
#include "maps/exchange/exchange.h"
#include "maps/library/library.h"
#include "maps/maintenance/recovery.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A library with four maps, of the keys 1 to 4.
class Tours : public ::testing::Test {
 protected:
  Tours() {
    Library library = OpenToWrite(file_);
    for (const char* name : {"Hall", "Lions", "Masks", "Ships"}) {
      const std::uint64_t key = library.NewKey();
      library.Save({key, name, Policy::kOpen, MakeSampleMap(key), nullptr});
    }
  }
  void Add(const Tour& tour) {
    OpenToWrite(file_).ChangeTours([&](std::vector<Tour>* tours) { tours->push_back(tour); });
  }
  std::vector<Tour> Read() const { return OpenToRead(file_).Tours(); }

  const TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "a.docent";
  const Tour all_ = {"All \xC3\xBC", {1, 4, 2, 3}, "es-419", 90}, short_ = {"Short", {2}, "", 0};
};

TEST_F(Tours, AreReadAsWrittenInTheOrderOfTheirNames) {
  Add(short_);
  Add(all_);
  EXPECT_THAT(Read(), ElementsAre(all_, short_));
  EXPECT_THAT(OpenToRead(file_).Verify(), IsEmpty());
}

TEST_F(Tours, AreChangedRenamedAndRemoved) {
  Add(all_);
  Add(short_);
  Tour changed = all_;
  changed.stops = {3, 1};
  changed.name = "Best";
  OpenToWrite(file_).ChangeTours([&](std::vector<Tour>* tours) { *tours = {changed}; });
  EXPECT_THAT(Read(), ElementsAre(changed));
}

TEST_F(Tours, AreNotWrittenIfInvalid) {
  std::vector<Tour> wrong(9, short_);
  wrong[0].name = "";
  wrong[1].name = std::string(kMaxTourNameBytes + 1, 'x');
  wrong[2].name = "a\nb";
  wrong[3].stops = {2, 3, 2};
  wrong[4].stops = {0};
  wrong[5].language = "De";
  wrong[6].minutes = -1;
  wrong[7].minutes = kMaxTourMinutes + 1;
  wrong[8].stops.clear();
  for (std::uint64_t stop = 1; stop <= kMaxTourStops + 1; ++stop) wrong[8].stops.push_back(stop);
  for (const Tour& tour : wrong) {
    EXPECT_NE(ProblemOf(tour), "");
    EXPECT_NE(ErrorOf([&] { Add(tour); }), "") << tour.name;
  }
  EXPECT_EQ(ProblemOf(short_), "");
  Tour tagged = short_;
  tagged.language = std::string(kMaxTourLanguageBytes, 'a');
  EXPECT_EQ(ProblemOf(tagged), "");
  tagged.language += 'a';
  EXPECT_EQ(ProblemOf(tagged), "its language has more than 35 bytes");
  Tour nowhere = short_;
  nowhere.stops = {2, 9};
  EXPECT_THAT(ErrorOf([&] { Add(nowhere); }), HasSubstr("no map with the key 9"));
  EXPECT_THAT(Read(), IsEmpty());
}

TEST_F(Tours, HaveNamesOfTheirOwn) {
  Add(short_);
  EXPECT_THAT(ErrorOf([&] { Add(short_); }), HasSubstr("there is already a tour named 'Short'"));
  EXPECT_THAT(Read(), ElementsAre(short_));
}

TEST_F(Tours, AreUnchangedIfAChangeFails) {
  Add(short_);
  EXPECT_EQ(ErrorOf([&] {
              OpenToWrite(file_).ChangeTours([](std::vector<Tour>* tours) {
                tours->clear();
                throw Error("no");
              });
            }),
            "no");
  EXPECT_THAT(Read(), ElementsAre(short_));
}

TEST_F(Tours, KeepAMapThatIsRenamedAndLeaveOutOneThatIsRemoved) {
  Add(all_);
  Add(short_);
  Library library = OpenToWrite(file_);
  library.Rename(2, "Big cats");
  EXPECT_THAT(library.Tours(), ElementsAre(all_, short_));
  library.Remove(2);
  EXPECT_THAT(library.Tours(),
              ElementsAre(Tour{all_.name, {1, 4, 3}, "es-419", 90}, Tour{"Short", {}, "", 0}));
  EXPECT_THAT(library.Verify(), IsEmpty());
}

TEST_F(Tours, StopAtTheMapThatAStopWasJoinedInto) {
  Add(all_);
  Add(short_);
  Library library = OpenToWrite(file_);
  MapRecord record{3, "", Policy::kOpen, MakeSampleMap(9), nullptr};
  record.joined_keys = {2};
  library.Save(record);
  EXPECT_THAT(library.Tours(),
              ElementsAre(Tour{all_.name, {1, 4, 3}, "es-419", 90}, Tour{"Short", {3}, "", 0}));
  const JoinRecord join{library.Find(3), library.Find(1), MakeSampleMap(5), MakeTextScene(""), std::nullopt};
  EXPECT_TRUE(library.Join(join));
  EXPECT_THAT(library.Tours(), ElementsAre(Tour{all_.name, {3, 4}, "es-419", 90}, Tour{"Short", {3}, "", 0}));
  EXPECT_THAT(library.Verify(), IsEmpty());
}

TEST_F(Tours, AreReportedIfDamagedAndCostNothingElse) {
  Add(all_);
  Add(short_);
  const Bytes sound = ReadWholeFile(file_);
  for (const char* damage : {"UPDATE tours SET stops = x'00' WHERE name = 'Short'",
                             "UPDATE tours SET checksum = checksum + 1 WHERE name = 'Short'",
                             "UPDATE tours SET minutes = 7 WHERE name = 'Short'",
                             "UPDATE tours SET name = 'Shor' WHERE name = 'Short'"}) {
    WriteWholeFile(file_, sound);
    RunSql(file_, damage);
    EXPECT_THAT(ErrorOf([&] { Read(); }), HasSubstr("is damaged: the tour 'Shor")) << damage;
    EXPECT_THAT(OpenToRead(file_).Verify(), ElementsAre(HasSubstr("the tour 'Shor"))) << damage;
    std::vector<std::string> problems;
    EXPECT_THAT(OpenToRead(file_).Tours(&problems), ElementsAre(all_));
    EXPECT_EQ(problems.size(), 1u);
    OpenToWrite(file_).Remove(4);
    EXPECT_THAT(OpenToRead(file_).Tours(&problems), ElementsAre(Tour{all_.name, {1, 2, 3}, "es-419", 90}));
  }
}

TEST_F(Tours, ThatStopAtNoMapAreReported) {
  Add(short_);
  RunSql(file_,
         "DELETE FROM maps WHERE key = 2; DELETE FROM parts WHERE map_key = 2; DELETE FROM pictures "
         "WHERE map_key = 2; DELETE FROM thumbnails WHERE map_key = 2; DELETE FROM words WHERE map_key = 2");
  EXPECT_THAT(OpenToRead(file_).Verify(),
              ::testing::Contains(HasSubstr("the tour 'Short' stops at the map 2, which does not exist")));
}

TEST_F(Tours, AreImportedWithTheMapsAndNotExportedWithOne) {
  Add(all_);
  const auto other = folder_ / "b.docent";
  const Library from = OpenToRead(file_);
  const Imported first = ImportMaps(from, other), second = ImportMaps(from, other);
  EXPECT_EQ(first.tours.at(0).name, all_.name);
  EXPECT_EQ(second.tours.at(0).name, all_.name + " (2)");
  EXPECT_THAT(OpenToRead(other).Tours(),
              ElementsAre(all_, Tour{all_.name + " (2)", {5, 8, 6, 7}, "es-419", 90}));
  EXPECT_THAT(OpenToRead(other).Verify(), IsEmpty());
  ExportMap(from, 2, folder_ / "c.docent");
  EXPECT_THAT(OpenToRead(folder_ / "c.docent").Tours(), IsEmpty());
}

TEST_F(Tours, AreRecoveredWithoutTheMapsThatAreLost) {
  Add(all_);
  Add(short_);
  RunSql(file_,
         "DELETE FROM parts WHERE map_key = 4; DELETE FROM pictures WHERE map_key = 4; UPDATE tours "
         "SET minutes = 7 WHERE name = 'Short'");
  const Recovery recovery = Recover(file_, folder_ / "saved.docent");
  EXPECT_THAT(recovery.problems,
              ::testing::IsSupersetOf({HasSubstr("1 of its stops"), HasSubstr("the tour 'Short': ")}));
  const Library saved = OpenToRead(folder_ / "saved.docent");
  EXPECT_THAT(saved.Tours(), ElementsAre(Tour{all_.name, {1, 2, 3}, "es-419", 90}));
  EXPECT_THAT(saved.Verify(), IsEmpty());
}

}  // namespace
}  // namespace docent::maps

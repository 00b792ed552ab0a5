// SPDX-License-Identifier: Apache-2.0
#include "maps/maintenance/recovery.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "maps/library/library.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Recovering : public ::testing::Test {
 protected:
  Recovering() {
    Library library = OpenToWrite(file_);
    for (std::uint64_t i = 0; i < maps_.size(); ++i)
      library.Save({library.NewKey(), NameOf(i), Policy::kOpen, maps_[i], MakeSampleScene(i, 1)});
  }
  static std::string NameOf(std::size_t i) { return "map number " + std::to_string(i); }
  void RunSql(const std::string& sql) const { maps::RunSql(file_, sql); }
  Library OpenRecovered() const { return OpenToRead(target_); }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "a.docent", target_ = folder_ / "b.docent";
  std::vector<std::shared_ptr<engine::MapSnapshot>> maps_ = {
      MakeSampleMap(1), MakeSampleMap(2, {.keyframes = 6}), MakeSampleMap(3), MakeSampleMap(4)};
};

TEST_F(Recovering, AnUndamagedLibraryIsRecoveredCompletely) {
  const Bytes before = ReadWholeFile(file_);
  const Recovery recovery = Recover(file_, target_);
  EXPECT_EQ(recovery.maps_complete, 4u);
  EXPECT_EQ(recovery.maps_partial, 0u);
  EXPECT_THAT(recovery.problems, IsEmpty());
  EXPECT_EQ(ReadWholeFile(file_), before);
  const Library library = OpenRecovered();
  EXPECT_THAT(library.Verify(), IsEmpty());
  for (std::size_t i = 0; i < maps_.size(); ++i) {
    const StoredMap stored = library.Load(library.FindByName(NameOf(i)).key);
    EXPECT_EQ(FirstDifference(*stored.snapshot, *maps_[i]), "");
    EXPECT_EQ(FirstDifference(stored.scene, *MakeSampleScene(i, 1)), "");
  }
  EXPECT_THAT(ErrorOf([&] { Recover(file_, target_); }), HasSubstr("exists already"));
}

TEST_F(Recovering, AFileOfOthersBesideTheTargetStays) {
  WriteWholeFile(folder_ / "b.docent.part", Bytes(10, 'x'));
  EXPECT_EQ(Recover(file_, target_).maps_complete, 4u);
  EXPECT_EQ(FilesIn(folder_.path()), "a.docent b.docent b.docent.part");
}

TEST_F(Recovering, LossesAreNamedAndTheRestIsRecovered) {
  RunSql("DELETE FROM pictures WHERE map_key = 2 AND keyframe = 3");  // One keyframe of six.
  RunSql("UPDATE parts SET data = x'00' WHERE map_key = 3 AND part = 'points'");
  RunSql("UPDATE maps SET name = 'forged' WHERE key = 4");  // Its checksum no longer matches.
  RunSql("DELETE FROM assets WHERE id = 'asset-0'");        // Used by the scene of the first map.
  const Recovery recovery = Recover(file_, target_);
  EXPECT_EQ(recovery.maps_complete, 0u);
  EXPECT_EQ(recovery.maps_partial, 4u);
  EXPECT_THAT(recovery.problems, Contains(HasSubstr("the image of keyframe 3 is missing")));
  EXPECT_THAT(recovery.problems, Contains(HasSubstr("the table of points is cut off")));
  EXPECT_THAT(recovery.problems, Contains(HasSubstr("the entry of map 4: its checksum does not match")));
  EXPECT_THAT(recovery.problems, Contains(HasSubstr("the asset asset-0 is missing")));
  const Library library = OpenRecovered();
  EXPECT_THAT(library.Verify(), IsEmpty());
  EXPECT_EQ(library.List().size(), 4u);
  const auto without_points = library.Load(library.FindByName(NameOf(2)).key).snapshot;
  EXPECT_EQ(without_points->keyframes.size(), 3u);
  EXPECT_EQ(without_points->points.size(), 0u);
  EXPECT_EQ(FirstDifference(*library.Load(library.FindByName(NameOf(0)).key).snapshot, *maps_[0]), "");
  const auto second = library.Load(library.FindByName(NameOf(1)).key).snapshot;
  EXPECT_EQ(second->keyframes.size(), 5u);
  EXPECT_EQ(second->FindKeyFrame(3), nullptr);
  EXPECT_GT(second->points.size(), maps_[1]->points.size() / 2);
  EXPECT_EQ(FirstDifference(library.Load(library.FindByName("map 4").key).scene, *MakeSampleScene(3, 1)), "");
}

TEST_F(Recovering, NothingWrongIsRecoveredFromFlippedBytesAndTruncatedFiles) {
  const Bytes intact = ReadWholeFile(file_);
  Random random(9);
  int recovered = 0, nothing = 0;
  for (int i = 0; i < 120; ++i) {
    Bytes damaged = intact;
    if (i % 3 == 0) {
      damaged.resize(intact.size() / 3 + random.Below(static_cast<std::uint32_t>(2 * intact.size() / 3)));
    } else {
      for (int flips = 0; flips < 5; ++flips)
        damaged[random.Below(static_cast<std::uint32_t>(intact.size()))] ^=
            static_cast<std::uint8_t>(1 + random.Below(255));
    }
    WriteWholeFile(file_, damaged);
    std::filesystem::remove(target_);
    Recovery recovery;
    try {
      recovery = Recover(file_, target_);
    } catch (const Error&) {
      ++nothing;
      EXPECT_FALSE(std::filesystem::exists(target_));
      continue;
    }
    ++recovered;
    EXPECT_EQ(ReadWholeFile(file_), damaged);
    const Library library = OpenRecovered();
    EXPECT_THAT(library.Verify(), IsEmpty());
    const auto infos = library.List();
    EXPECT_EQ(infos.size(), recovery.maps_complete + recovery.maps_partial);
    std::size_t equal = 0;
    for (const MapInfo& info : infos) {
      const auto map = library.Load(info.key).snapshot;
      for (const auto& original : maps_) equal += FirstDifference(*map, *original).empty();
    }
    EXPECT_GE(equal, recovery.maps_complete);
  }
  EXPECT_GT(recovered, 60);
  RecordProperty("nothing_recovered", nothing);
}

TEST_F(Recovering, NoFileIsLeftWhenNothingCanBeRecovered) {
  RunSql("DELETE FROM parts");
  EXPECT_THAT(ErrorOf([&] { Recover(file_, target_); }), HasSubstr("nothing could be recovered"));
  WriteWholeFile(file_, Bytes(5000, 'x'));
  EXPECT_THAT(ErrorOf([&] { Recover(file_, target_); }), HasSubstr("not a library of maps"));
  EXPECT_EQ(FilesIn(folder_.path()), "a.docent");
}

}  // namespace
}  // namespace docent::maps

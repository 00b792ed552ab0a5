// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/error.h"
#include "engine/base/random.h"
#include "maps/library/library.h"
#include "maps/storage/map_codec.h"
#include "maps/storage/schema.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// A closed library with two maps and an asset, in its own folder.
class Damage : public ::testing::Test {
 protected:
  Damage() {
    Library library = Open(Access::kReadWrite, CreateIfMissing::kYes);
    library.Save({library.NewKey(), "Desk", Policy::kOpen, desk_, scene_});
    library.Save({library.NewKey(), "Door", Policy::kBounded, door_, nullptr});
  }
  Library Open(Access access, CreateIfMissing create = CreateIfMissing::kNo) const {
    return Library::Open(file_, access, create, QuickOptions());
  }
  void RunSql(const std::string& sql) const { maps::RunSql(file_, sql); }
  std::vector<std::string> Verify() const { return Open(Access::kReadOnly).Verify(); }
  // Checks that opening fails with one sentence about the file, changes none of its bytes and creates no
  // other file.
  void ExpectRefused(const std::string& part_of_sentence) const {
    const Bytes before = ReadWholeFile(file_);
    const auto modes = {std::pair{Access::kReadOnly, CreateIfMissing::kNo},
                        std::pair{Access::kReadWrite, CreateIfMissing::kNo},
                        std::pair{Access::kReadWrite, CreateIfMissing::kYes}};
    for (const auto& [access, create] : modes) {
      const std::string error = ErrorOf([&, a = access, c = create] { Open(a, c); });
      EXPECT_THAT(error, StartsWith(file_.string()));
      EXPECT_THAT(error, HasSubstr(part_of_sentence));
      EXPECT_EQ(error.find('\n'), std::string::npos);
      EXPECT_EQ(ReadWholeFile(file_), before);
      EXPECT_EQ(FilesIn(folder_.path()), "a.docent");
    }
  }
  // Checks that everything that can be read from a damaged file is what was saved, and that Verify finds no
  // error only if there is none.
  void ExpectErrorOrTruth() {
    bool valid = false;
    const std::string error = ErrorOf([&] {
      const Library library = Open(Access::kReadOnly);
      valid = library.Verify().empty();
      const auto keys = {std::pair{1, desk_.get()}, std::pair{2, door_.get()}};
      for (const auto& [key, expected] : keys) {
        const std::string map_error = ErrorOf([&, k = key, e = expected] {
          const StoredMap stored = library.Load(static_cast<std::uint64_t>(k));
          EXPECT_EQ(FirstDifference(*stored.snapshot, *e), "");
          EXPECT_EQ(stored.info.name, k == 1 ? "Desk" : "Door");
          EXPECT_EQ(stored.info.policy, k == 1 ? Policy::kOpen : Policy::kBounded);
          if (k == 1) {
            EXPECT_EQ(FirstDifference(stored.scene, *scene_), "");
          }
        });
        EXPECT_TRUE(!valid || map_error.empty()) << map_error;
        if (!map_error.empty()) ++errors_;
      }
    });
    if (!error.empty()) ++errors_;
    EXPECT_FALSE(valid && !error.empty()) << error;
  }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "a.docent";
  std::shared_ptr<engine::MapSnapshot> desk_ = MakeSampleMap(1, {.keyframes = 2, .points = 30});
  std::shared_ptr<engine::MapSnapshot> door_ = MakeSampleMap(2, {.keyframes = 3, .points = 60});
  std::shared_ptr<SceneRecord> scene_ = MakeSampleScene(3, 1);
  int errors_ = 0;
};

TEST_F(Damage, MissingAndIrregularFilesAreRejected) {
  EXPECT_THAT(ErrorOf([&] { Library::Open(folder_ / "b.docent", Access::kReadOnly); }),
              HasSubstr("does not exist"));
  EXPECT_THAT(ErrorOf([&] { Library::Open(folder_ / "b.docent", Access::kReadWrite); }),
              HasSubstr("does not exist"));
  EXPECT_THAT(ErrorOf([&] { Library::Open(folder_.path(), Access::kReadOnly); }), HasSubstr("is a folder"));
  EXPECT_THAT(ErrorOf([&] { Library::Open("/dev/null", Access::kReadOnly); }), HasSubstr("not a plain file"));
  EXPECT_THAT(
      ErrorOf([&] { Library::Open(folder_ / "x/b.docent", Access::kReadWrite, CreateIfMissing::kYes); }),
      HasSubstr("there is no folder"));
  EXPECT_EQ(FilesIn(folder_.path()), "a.docent");
}

TEST_F(Damage, AFileOfAnotherTypeIsRejected) {
  const std::string text(5000, 'x');
  WriteWholeFile(file_, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
  ExpectRefused("is not a library of maps");
}

TEST_F(Damage, AnSqliteFileOfAnotherProgramIsRejected) {
  RunSql("PRAGMA application_id = 7");
  ExpectRefused("SQLite file of another program");
}

TEST_F(Damage, ALibraryOfANewerFormatIsRejected) {
  RunSql("PRAGMA user_version = 7");
  ExpectRefused("written by a newer Docent (format 7;");
}

TEST_F(Damage, ALibraryWithOtherTablesIsRejected) {
  RunSql("CREATE TRIGGER t AFTER UPDATE ON maps BEGIN DELETE FROM pictures; END");
  ExpectRefused("its table 't' is not one");
}

TEST_F(Damage, AnEmptyFileIsRejectedUnlessALibraryIsCreated) {
  WriteWholeFile(file_, {});
  EXPECT_THAT(ErrorOf([&] { Open(Access::kReadOnly); }), HasSubstr("is empty"));
  EXPECT_THAT(ErrorOf([&] { Open(Access::kReadWrite); }), HasSubstr("is empty"));
  EXPECT_TRUE(ReadWholeFile(file_).empty());
  EXPECT_TRUE(Open(Access::kReadWrite, CreateIfMissing::kYes).List().empty());
}

TEST_F(Damage, AFileTruncatedAnywhereIsRejected) {
  const Bytes original = ReadWholeFile(file_);
  Random random(5);
  for (int i = 0; i < 60; ++i) {
    const std::size_t size =
        i < 20 ? 1 + i * 37 : 1 + random.Below(static_cast<std::uint32_t>(original.size() - 1));
    WriteWholeFile(file_, std::span(original).first(size));
    const std::string error = ErrorOf([&] { Open(Access::kReadOnly).List(); });
    EXPECT_THAT(error, StartsWith(file_.string())) << size;
    EXPECT_THAT(ErrorOf([&] { Open(Access::kReadWrite); }), StartsWith(file_.string())) << size;
    EXPECT_EQ(ReadWholeFile(file_).size(), size);
    EXPECT_EQ(FilesIn(folder_.path()), "a.docent");
  }
}

TEST_F(Damage, FlippedBytesNeverGiveWrongData) {
  const Bytes original = ReadWholeFile(file_);
  Random random(11);
  for (int i = 0; i < 400; ++i) {
    Bytes damaged = original;
    // Page headers are the most critical bytes, so half of the flips are in them.
    const auto page = random.Below(static_cast<std::uint32_t>(original.size() / 4096)) * 4096;
    const std::size_t at =
        i % 2 == 0 ? page + random.Below(120) : random.Below(static_cast<std::uint32_t>(original.size()));
    damaged[at] ^= static_cast<std::uint8_t>(1 + random.Below(255));
    WriteWholeFile(file_, damaged);
    ExpectErrorOrTruth();
    ASSERT_FALSE(HasFailure()) << "byte " << at;
  }
  EXPECT_GT(errors_, 100) << "the flips caused too few errors";
}

TEST_F(Damage, ASmallFileCannotRequestLargeImages) {
  const engine::CameraModel::Intrinsics vast{8000, 8000, 500, 500, 4000, 4000};
  const CameraTable cameras(2, std::make_shared<const engine::CameraModel>(
                                   engine::LensModel::kRadialTangential, vast, std::array<double, 5>{}));
  std::string hex;
  for (const std::uint8_t byte : EncodeCameras(1, cameras)) {
    for (const int half : {byte >> 4, byte & 15}) hex += "0123456789ABCDEF"[half];
  }
  RunSql("UPDATE parts SET data = x'" + hex + "' WHERE map_key = 1 AND part = 'cameras'");
  const Library library = Open(Access::kReadOnly);
  EXPECT_THAT(ErrorOf([&] { library.Load(1); }), HasSubstr("image size is impossible for so small a file"));
  EXPECT_EQ(FirstDifference(*library.Load(2).snapshot, *door_), "");
}

TEST_F(Damage, ALargeUniformImageIsAccepted) {
  auto map = MakeSampleMap(3, {.keyframes = 1, .points = 0, .width_px = 2048, .height_px = 1536});
  auto features = std::make_shared<engine::ImageFeatures>(*map->keyframes[0].features);
  features->levels[0] = cv::Mat(1536, 2048, CV_8UC1, cv::Scalar(90));
  map->keyframes[0].features = features;
  Library library = Open(Access::kReadWrite);
  library.Save({library.NewKey(), "Night", Policy::kOpen, map, nullptr});
  EXPECT_EQ(FirstDifference(*library.Load(3).snapshot, *map), "");
  EXPECT_TRUE(library.Verify().empty());
}

TEST_F(Damage, VerifyNamesEachDamagedPart) {
  const auto cases = {
      std::pair{
          "UPDATE parts SET data = substr(data, 1, length(data) - 9) WHERE map_key = 1 AND part = 'points'",
          "map 'Desk' (1): the table of points is damaged: its checksum does not match"},
      std::pair{"DELETE FROM pictures WHERE map_key = 2 AND keyframe = 1",
                "map 'Door' (2): the image of keyframe 1 is missing"},
      std::pair{"UPDATE pictures SET data = (SELECT data FROM pictures WHERE map_key = 2 AND keyframe = 0) "
                "WHERE map_key = 1 AND keyframe = 0",
                "map 'Desk' (1): the image belongs to another map"},
      std::pair{"UPDATE maps SET policy = 'open' WHERE key = 2",
                "the entry of map 2: its checksum does not match"},
      std::pair{"DELETE FROM parts WHERE part = 'scene' AND map_key = 1",
                "map 'Desk' (1): its part 'scene' is missing"},
      std::pair{"DELETE FROM parts WHERE part = 'points.blocks' AND map_key = 1",
                "map 'Desk' (1): its part 'points.blocks' is missing"},
      std::pair{"DELETE FROM words WHERE map_key = 2", "map 'Door' (2): its words are missing"},
      std::pair{"DELETE FROM thumbnails WHERE map_key = 2", "map 'Door' (2): its thumbnails are missing"},
      std::pair{"UPDATE thumbnails SET data = (SELECT data FROM thumbnails WHERE map_key = 1)",
                "map 'Door' (2): the table of thumbnails belongs to another map"},
      std::pair{"DELETE FROM assets", "the asset asset-3 is missing"},
      std::pair{"UPDATE assets SET data = x'00'", "asset 'model 3.glb' is damaged"},
      std::pair{"DELETE FROM maps WHERE key = 1", "its first entry gives 2 maps but 1 are there"},
      std::pair{"DELETE FROM library", "its first entry is missing"},
  };
  const Bytes original = ReadWholeFile(file_);
  EXPECT_EQ(Verify(), std::vector<std::string>{});
  for (const auto& [sql, sentence] : cases) {
    WriteWholeFile(file_, original);
    RunSql(sql);
    EXPECT_THAT(Verify(), Contains(HasSubstr(sentence))) << sql;
    for (const std::string& line : Verify()) EXPECT_THAT(line, StartsWith(file_.string()));
  }
}

}  // namespace
}  // namespace docent::maps

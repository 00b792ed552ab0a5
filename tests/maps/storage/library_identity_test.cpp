// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/library_identity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "maps/library/library.h"
#include "maps/maintenance/recovery.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class LibraryIdentityRows : public ::testing::Test {
 protected:
  void SetUp() override {
    Library library = OpenToWrite(file_);
    MapRecord record{library.NewKey(), "Desk", Policy::kOpen, MakeSampleMap(1), nullptr};
    record.lenses = {lens_};
    library.Save(record);
  }
  static std::string Read(const std::filesystem::path& file) {
    return ReadLibraryIdentity(Database::OpenReadOnly(file)).current;
  }
  void Write(const std::string& identity) {
    RenewLibraryIdentity(Database::OpenReadWrite(file_, false), identity);
  }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "a.docent";
  // Of a camera that happens to have such a name.
  const StoredLens lens_{"library camera",
                         engine::CameraModel(engine::LensModel::kRadialTangential,
                                             {640, 480, 500, 500, 320, 240}, {0.01, 0, 0, 0, 0}),
                         0.01, false};
};

TEST_F(LibraryIdentityRows, IsReadAsWrittenAndCopiedWithTheFile) {
  EXPECT_EQ(Read(file_), "");
  Write("one");
  EXPECT_EQ(Read(file_), "one");
  std::filesystem::copy_file(file_, folder_ / "copy.docent");
  EXPECT_EQ(Read(folder_ / "copy.docent"), "one");
}

TEST_F(LibraryIdentityRows, OnlyThePreviousOneIsKeptBesideIt) {
  for (const char* identity : {"three", "one", "two"}) Write(identity);
  const LibraryIdentity read = ReadLibraryIdentity(Database::OpenReadOnly(file_));
  EXPECT_EQ(read.current, "two");
  EXPECT_EQ(read.previous, "one");
  EXPECT_EQ(Database::OpenReadOnly(file_).Number("SELECT count(*) FROM lenses"), 3) << "with the camera";
}

TEST_F(LibraryIdentityRows, IsNoLensAndNoDamage) {
  Write("one");
  Write("two");
  const Library library = OpenToRead(file_);
  EXPECT_THAT(library.Lenses(), ElementsAre(lens_));
  EXPECT_THAT(library.Verify(), IsEmpty());
}

TEST_F(LibraryIdentityRows, DoesNotCountIfDamaged) {
  Write("one");
  RunSql(file_, "UPDATE lenses SET camera = 'library two' WHERE camera = 'library one'");
  EXPECT_EQ(Read(file_), "");
}

TEST_F(LibraryIdentityRows, IsNotRecovered) {
  Write("one");
  const auto saved = folder_ / "saved.docent";
  EXPECT_THAT(Recover(file_, saved).problems, IsEmpty());
  EXPECT_EQ(Read(saved), "");
  EXPECT_THAT(OpenToRead(saved).Lenses(), ElementsAre(lens_));
}

}  // namespace
}  // namespace docent::maps

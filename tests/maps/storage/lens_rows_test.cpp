// SPDX-License-Identifier: Apache-2.0
#include "maps/storage/lens_rows.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "engine/base/error.h"
#include "maps/library/library.h"
#include "maps/maintenance/recovery.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

StoredLens MakeLens(const std::string& camera, double focal_px, double k1 = 0.03, double k2 = -0.01) {
  return {camera,
          engine::CameraModel(engine::LensModel::kRadialTangential, {640, 480, focal_px, focal_px, 321, 238},
                              {k1, k2, 0, 0, 0}),
          0.012, false};
}

class LensRows : public ::testing::Test {
 protected:
  void Save(std::vector<StoredLens> lenses) {
    Library library = OpenToWrite(file_);
    MapRecord record{library.NewKey(), "Map " + std::to_string(++count_), Policy::kOpen, MakeSampleMap(1),
                     nullptr};
    record.lenses = std::move(lenses);
    library.Save(record);
  }
  std::vector<StoredLens> Read() const { return OpenToRead(file_).Lenses(); }

  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "a.docent";
  int count_ = 0;
};

TEST_F(LensRows, AreReadAsWrittenInTheOrderOfTheirNames) {
  StoredLens fixed = MakeLens("/dev/video0", 512.25, -0.2, 0.04);
  fixed.fixed = true;
  fixed.focal_sigma = 0.004;
  const StoredLens open = MakeLens("A \"phone\" \xC3\xBC", 480);
  Save({open, fixed});
  EXPECT_THAT(Read(), ElementsAre(fixed, open));
  EXPECT_THAT(OpenToRead(file_).Verify(), IsEmpty());
}

TEST_F(LensRows, ReplaceEarlierEstimatesOfTheSameCamera) {
  Save({MakeLens("phone", 480), MakeLens("webcam", 600)});
  Save({MakeLens("phone", 505)});
  EXPECT_THAT(Read(), ElementsAre(MakeLens("phone", 505), MakeLens("webcam", 600)));
}

TEST_F(LensRows, AreSavedEvenIfTheMapIsUnchanged) {
  Library library = OpenToWrite(file_);
  MapRecord record{library.NewKey(), "Desk", Policy::kOpen, MakeSampleMap(1), nullptr};
  library.Save(record);
  record.lenses = {MakeLens("phone", 480)};
  library.Save(record);
  EXPECT_THAT(library.Lenses(), ElementsAre(MakeLens("phone", 480)));
}

TEST_F(LensRows, AreNotWrittenIfInvalid) {
  std::vector<StoredLens> wrong;
  wrong.push_back(MakeLens("", 480));
  wrong.push_back(MakeLens(std::string(kMaxCameraNameBytes + 1, 'x'), 480));
  for (const double sigma : {0.0, -0.1, 1.5, std::nan(""), std::numeric_limits<double>::infinity()}) {
    wrong.push_back(MakeLens("phone", 480));
    wrong.back().focal_sigma = sigma;
  }
  wrong.push_back(MakeLens("phone", 480));
  wrong.back().model =
      engine::CameraModel(engine::LensModel::kRadialTangential, {640, 480, 480, 490, 320, 240}, {});
  wrong.push_back(MakeLens("phone", 480));
  wrong.back().model = engine::CameraModel(engine::LensModel::kFov, {640, 480, 480, 480, 320, 240}, {0.9});
  for (const StoredLens& lens : wrong) {
    EXPECT_NE(ProblemOf(lens), "");
    EXPECT_THAT(ErrorOf([&] { Save({lens}); }), HasSubstr("cannot be saved"));
  }
  EXPECT_EQ(ProblemOf(MakeLens("phone", 480)), "");
  const Library library = OpenToRead(file_);
  EXPECT_THAT(library.Lenses(), IsEmpty());
  EXPECT_THAT(library.List(), IsEmpty()) << "the map is not saved either";
}

TEST_F(LensRows, AreReportedIfDamaged) {
  for (const char* damage :
       {"UPDATE lenses SET data = x'00'", "UPDATE lenses SET data = zeroblob(57)",
        "UPDATE lenses SET checksum = checksum + 1", "UPDATE lenses SET camera = 'another'",
        "UPDATE lenses SET data = CAST(substr(data, 1, 20) || x'01' || substr(data, 22) AS BLOB)"}) {
    Save({MakeLens("phone", 480)});
    RunSql(file_, damage);
    EXPECT_THAT(ErrorOf([&] { Read(); }), HasSubstr("is damaged: the lens of camera '")) << damage;
    EXPECT_THAT(OpenToRead(file_).Verify(), ElementsAre(HasSubstr("the lens of camera '"))) << damage;
    // The next save replaces the damaged row.
    RunSql(file_, "UPDATE lenses SET camera = 'phone'");
  }
}

TEST_F(LensRows, AreRecovered) {
  Save({MakeLens("phone", 480)});
  const auto saved = folder_ / "saved.docent";
  EXPECT_THAT(Recover(file_, saved).problems, IsEmpty());
  EXPECT_THAT(OpenToRead(saved).Lenses(), ElementsAre(MakeLens("phone", 480)));
}

TEST_F(LensRows, DoNotPreventTheRecoveryOfMapsIfDamaged) {
  Save({MakeLens("phone", 480)});
  RunSql(file_, "UPDATE lenses SET data = x'00'");
  const auto saved = folder_ / "saved.docent";
  const Recovery recovery = Recover(file_, saved);
  EXPECT_THAT(recovery.problems, ElementsAre(HasSubstr("the lens of camera 'phone': ")));
  EXPECT_EQ(recovery.maps_complete, 1u);
  EXPECT_THAT(OpenToRead(saved).Lenses(), IsEmpty());
}

}  // namespace
}  // namespace docent::maps

// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "maps/library/library.h"
#include "maps/library/saver.h"
#include "maps/maintenance/recovery.h"
#include "maps/storage/history_rows.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// A map with a scene, and a history that needs an asset which the scene has no more.
class History : public ::testing::Test {
 protected:
  History() {
    MapRecord record{1, "Desk", Policy::kOpen, MakeSampleMap(1), MakeSampleScene(10, 1)};
    record.history = HistoryOf("removed a model", 50, 3000);
    library_.NewKey();
    library_.Save(record);
  }
  static std::shared_ptr<SceneRecord> HistoryOf(const std::string& text, std::uint64_t asset,
                                                std::size_t bytes) {
    auto history = MakeTextScene(text);
    history->assets.push_back(MakeSampleAsset(asset, bytes));
    return history;
  }
  MapRecord Change(std::shared_ptr<const SceneRecord> scene,
                   std::shared_ptr<const SceneRecord> history) const {
    MapRecord record{1, "", Policy::kOpen, nullptr, std::move(scene)};
    record.history = std::move(history);
    return record;
  }

  const TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_ / "a.docent";
  Library library_ = OpenToWrite(file_);
};

TEST_F(History, IsReadAsItWasSavedWithItsAssets) {
  const auto history = OpenToRead(file_).LoadHistory(1);
  ASSERT_TRUE(history.has_value());
  EXPECT_EQ(FirstDifference(*history, *HistoryOf("removed a model", 50, 3000)), "");
  EXPECT_THAT(library_.Verify(), IsEmpty());
  // A change of keyframes and points leaves it.
  library_.Save({1, "", Policy::kOpen, MakeSampleMap(2), nullptr});
  EXPECT_TRUE(library_.LoadHistory(1).has_value());
}

TEST_F(History, EndsWithASceneThatWasChangedWithoutIt) {
  library_.Save(Change(MakeSampleScene(11, 1), nullptr));
  EXPECT_FALSE(library_.LoadHistory(1).has_value());
  library_.Save(Change(MakeSampleScene(12, 1), HistoryOf("again", 51, 10)));
  EXPECT_EQ(library_.LoadHistory(1)->text, "again");
  library_.Save(Change(nullptr, std::make_shared<SceneRecord>()));
  EXPECT_FALSE(library_.LoadHistory(1).has_value());
  EXPECT_THAT(library_.Verify(), IsEmpty());
  // Its assets went with it.
  EXPECT_EQ(library_.LoadScene(1).assets.size(), 1u);
  RunSql(file_, "CREATE TEMP TABLE c (n CHECK (n = 1)); INSERT INTO c SELECT count(*) FROM assets");
}

TEST_F(History, ThatIsDamagedCostsNothingElse) {
  RunSql(file_, "UPDATE parts SET data = x'00' WHERE part = 'history'");
  EXPECT_THAT(library_.Verify(), ElementsAre(HasSubstr("the undo history is cut off")));
  EXPECT_THAT(ErrorOf([&] { library_.LoadHistory(1); }), HasSubstr("the undo history is cut off"));
  EXPECT_EQ(FirstDifference(library_.Load(1).scene, *MakeSampleScene(10, 1)), "");
  // The next save replaces it.
  library_.Save(Change(nullptr, HistoryOf("new", 52, 10)));
  EXPECT_EQ(library_.LoadHistory(1)->text, "new");
  EXPECT_THAT(library_.Verify(), IsEmpty());
}

TEST_F(History, IsLimitedInSize) {
  const auto too_long = MakeTextScene(std::string(kMaxHistoryTextBytes + 1, 'x'));
  EXPECT_THAT(ErrorOf([&] { library_.Save(Change(nullptr, too_long)); }),
              HasSubstr("undo history has more than"));
  EXPECT_THAT(ErrorOf([&] { library_.Save(Change(nullptr, HistoryOf("x", 53, kMaxHistoryAssetBytes + 1))); }),
              HasSubstr("64 MiB"));
  EXPECT_EQ(library_.LoadHistory(1)->text, "removed a model") << "nothing was written";
  library_.Save(Change(nullptr, MakeTextScene(std::string(kMaxHistoryTextBytes, 'x'))));
  EXPECT_EQ(library_.LoadHistory(1)->text.size(), kMaxHistoryTextBytes);
}

TEST_F(History, StaysWithItsSceneWhileTheSaverWaits) {
  std::atomic<bool> release = false;
  Saver saver(&library_, 16, {}, [&](const std::atomic<bool>&) {
    while (!release) std::this_thread::yield();
    return false;
  });
  saver.Submit(Change(MakeSampleScene(20, 1), HistoryOf("first", 60, 10)));
  saver.Submit(Change(MakeSampleScene(21, 1), HistoryOf("second", 61, 10)));
  release = true;
  saver.Flush();
  EXPECT_EQ(library_.LoadHistory(1)->text, "second");
}

TEST_F(History, IsRecoveredOrLostAlone) {
  { Library closed = std::move(library_); }
  Recover(file_, folder_ / "b.docent", SampleSceneTools());
  EXPECT_EQ(OpenToRead(folder_ / "b.docent").LoadHistory(1)->text, "removed a model");
  RunSql(file_, "DELETE FROM assets WHERE id = 'asset-50'");
  const Recovery recovery = Recover(file_, folder_ / "c.docent", SampleSceneTools());
  EXPECT_EQ(recovery.maps_complete, 1u);
  EXPECT_THAT(recovery.problems, ElementsAre(HasSubstr("the asset asset-50 is missing")));
  EXPECT_FALSE(OpenToRead(folder_ / "c.docent").LoadHistory(1).has_value());
}

TEST(HistoryPart, IsRefusedUnlessItIsWhole) {
  const HistoryPart part{7, {"text", {"asset-1", "asset-2"}}};
  const Bytes bytes = EncodeHistory(3, part);
  EXPECT_EQ(DecodeHistory(3, bytes), part);
  EXPECT_NE(ErrorOf([&] { DecodeHistory(4, bytes); }), "");
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_NE(ErrorOf([&] { DecodeHistory(3, std::span(bytes).first(size)); }), "");
  EXPECT_NE(ErrorOf([&] { DecodeHistory(3, EncodeHistory(3, {7, {"text", {"asset-1", "asset-1"}}})); }), "");
}

}  // namespace
}  // namespace docent::maps

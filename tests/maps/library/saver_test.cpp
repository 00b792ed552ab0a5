// SPDX-License-Identifier: Apache-2.0
#include "maps/library/saver.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "engine/base/error.h"
#include "tests/maps/map_samples.h"
#include "tests/support/wait_until.h"

namespace docent::maps {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class SaverTest : public ::testing::Test {
 protected:
  SaverTest() {
    LibraryOptions options = QuickOptions();
    options.clock = [this] {
      ++saves_;
      WaitUntil([this] { return !hold_; });
      return WallTime{};
    };
    library_.emplace(Library::Open(folder_ / "a.docent", Access::kReadWrite, CreateIfMissing::kYes, options));
  }
  void WaitUntilASaveRuns() const {
    ASSERT_TRUE(WaitUntil([this] { return saves_ > 0; }));
  }

  TemporaryFolder folder_;
  std::atomic<bool> hold_ = false;  // While it is set, a save that has begun waits.
  std::atomic<int> saves_ = 0;
  std::optional<Library> library_;
};

TEST_F(SaverTest, SavesInTheBackgroundAndFlushWaitsForAll) {
  Saver saver(&*library_);
  const std::uint64_t a = library_->NewKey(), b = library_->NewKey();
  const auto desk = MakeSampleMap(1), door = MakeSampleMap(2);
  saver.Submit({a, "Desk", Policy::kOpen, desk, MakeSampleScene(1, 1)});
  saver.Submit({b, "Door", Policy::kOpen, door, nullptr});
  saver.Flush();
  EXPECT_EQ(saver.pending(), 0u);
  EXPECT_EQ(saver.TakeError(), nullptr);
  EXPECT_EQ(FirstDifference(*library_->Load(a).snapshot, *desk), "");
  EXPECT_EQ(FirstDifference(*library_->Load(b).snapshot, *door), "");
}

TEST_F(SaverTest, TheLatestSnapshotIsSavedAndAnEarlierSceneIsNotLost) {
  const std::uint64_t a = library_->NewKey(), b = library_->NewKey();
  Saver saver(&*library_);
  hold_ = true;
  saver.Submit({a, "Busy", Policy::kOpen, MakeSampleMap(1), nullptr});
  ASSERT_NO_FATAL_FAILURE(WaitUntilASaveRuns());
  const auto scene = MakeSampleScene(5, 1);
  const auto last = MakeSampleMap(10);
  saver.Submit({b, "Door", Policy::kOpen, MakeSampleMap(2), scene});
  for (std::uint64_t seed = 3; seed < 10; ++seed)
    saver.Submit({b, "", Policy::kOpen, MakeSampleMap(seed), nullptr});
  saver.Submit({b, "", Policy::kOpen, last, nullptr});
  EXPECT_EQ(saver.pending(), 2u);
  hold_ = false;
  saver.Flush();
  EXPECT_EQ(saver.TakeError(), nullptr);
  EXPECT_EQ(saves_, 2);
  EXPECT_EQ(library_->Find(b).name, "Door");
  EXPECT_EQ(FirstDifference(*library_->Load(b).snapshot, *last), "");
  EXPECT_EQ(FirstDifference(library_->LoadScene(b), *scene), "");
}

TEST_F(SaverTest, OfWaitingEstimatesOfALensTheLatestIsSaved) {
  const auto lens = [](const std::string& camera, double focal_px) {
    return StoredLens{camera,
                      engine::CameraModel(engine::LensModel::kRadialTangential,
                                          {640, 480, focal_px, focal_px, 320, 240}, {0, 0, 0, 0, 0}),
                      0.01, false};
  };
  const std::uint64_t a = library_->NewKey(), b = library_->NewKey();
  Saver saver(&*library_);
  hold_ = true;
  saver.Submit({a, "Busy", Policy::kOpen, MakeSampleMap(1), nullptr});
  ASSERT_NO_FATAL_FAILURE(WaitUntilASaveRuns());
  MapRecord record{b, "Door", Policy::kOpen, MakeSampleMap(2), nullptr};
  record.lenses = {lens("left", 500), lens("right", 500)};
  saver.Submit(record);
  record.lenses = {lens("left", 510)};
  saver.Submit(record);
  record.lenses = {};
  saver.Submit(record);
  hold_ = false;
  saver.Flush();
  EXPECT_EQ(saver.TakeError(), nullptr);
  EXPECT_THAT(library_->Lenses(), ElementsAre(lens("left", 510), lens("right", 500)));
}

TEST_F(SaverTest, DoesNotRestoreAMapThatWasJoinedIntoAnother) {
  const std::uint64_t a = library_->NewKey(), b = library_->NewKey();
  Saver saver(&*library_);
  hold_ = true;
  saver.Submit({b, "Door", Policy::kOpen, MakeSampleMap(2), nullptr});
  ASSERT_NO_FATAL_FAILURE(WaitUntilASaveRuns());
  // The waiting save of `a` takes over that `b` was joined into it.
  saver.Submit({a, "Desk", Policy::kOpen, MakeSampleMap(1), nullptr});
  saver.Submit({b, "", Policy::kOpen, MakeSampleMap(3), nullptr});
  MapRecord both{a, "", Policy::kOpen, MakeSampleMap(4), nullptr};
  both.joined_keys = {b};
  saver.Submit(both);
  EXPECT_EQ(saver.pending(), 2u);
  hold_ = false;
  saver.Flush();
  EXPECT_EQ(saver.TakeError(), nullptr);
  ASSERT_EQ(library_->List().size(), 1u);
  EXPECT_EQ(FirstDifference(*library_->Load(a).snapshot, *both.snapshot), "");
}

TEST_F(SaverTest, ReportsAFailureAndContinues) {
  const std::uint64_t key = library_->NewKey();
  Saver saver(&*library_);
  saver.Submit({key + 50, "Nowhere", Policy::kOpen, MakeSampleMap(1), nullptr});
  saver.Submit({key, "Desk", Policy::kOpen, MakeSampleMap(2), nullptr});
  saver.Flush();
  const std::exception_ptr error = saver.TakeError();
  ASSERT_NE(error, nullptr);
  EXPECT_THAT(ErrorOf([&] { std::rethrow_exception(error); }), HasSubstr("map 'Nowhere'"));
  EXPECT_EQ(saver.TakeError(), nullptr);
  EXPECT_EQ(library_->List().size(), 1u);
}

TEST_F(SaverTest, WritesWaitingSavesBeforeItEnds) {
  const std::uint64_t first = library_->NewKey();
  for (int i = 1; i < 8; ++i) library_->NewKey();
  {
    Saver saver(&*library_);
    for (std::uint64_t key = first; key < first + 8; ++key) {
      saver.Submit({key, "Map " + std::to_string(key), Policy::kOpen, MakeSampleMap(key), nullptr});
    }
  }
  EXPECT_EQ(library_->List().size(), 8u);
}

TEST_F(SaverTest, AFullQueueBlocksOtherMapsButNotNewerStatesOfTheSame) {
  const std::uint64_t a = library_->NewKey(), b = library_->NewKey(), c = library_->NewKey();
  Saver saver(&*library_, 1);
  hold_ = true;
  saver.Submit({a, "A", Policy::kOpen, MakeSampleMap(1), nullptr});
  ASSERT_NO_FATAL_FAILURE(WaitUntilASaveRuns());
  saver.Submit({b, "B", Policy::kOpen, MakeSampleMap(2), nullptr});
  saver.Submit({b, "B", Policy::kOpen, MakeSampleMap(3), nullptr});
  std::atomic<bool> submitting = false, submitted = false;
  std::jthread other([&] {
    submitting = true;
    saver.Submit({c, "C", Policy::kOpen, MakeSampleMap(4), nullptr});
    submitted = true;
  });
  // Once the thread runs, a call that does not block returns long before this.
  ASSERT_TRUE(WaitUntil([&] { return submitting.load(); }));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_FALSE(submitted);
  EXPECT_EQ(saver.pending(), 2u);
  hold_ = false;
  other.join();
  saver.Flush();
  EXPECT_EQ(library_->List().size(), 3u);
}

TEST_F(SaverTest, SavesDoNotWaitForMaintenanceOrInterruptIt) {
  const std::uint64_t key = library_->NewKey();
  std::atomic<int> begun = 0, ended = 0;
  Saver saver(&*library_, 16, {}, [&](const std::atomic<bool>& interrupt) {
    ++begun;
    while (!interrupt) std::this_thread::yield();
    ++ended;
    return true;
  });
  ASSERT_TRUE(WaitUntil([&] { return begun > 0; }));
  for (std::uint64_t round = 1; round < 5; ++round) {
    saver.Submit({key, "Desk", Policy::kOpen, MakeSampleMap(round), nullptr});
    saver.Flush();
    EXPECT_EQ(FirstDifference(*library_->Load(key).snapshot, *MakeSampleMap(round)), "");
  }
  EXPECT_EQ(ended, 0);
  saver.InterruptMaintenance();
  ASSERT_TRUE(WaitUntil([&] { return begun >= 2; }));
  saver.EndMaintenance();
  const int at_the_end = begun;
  EXPECT_EQ(ended, at_the_end);
  saver.Submit({key, "Desk", Policy::kOpen, MakeSampleMap(9), nullptr});
  saver.Flush();
  EXPECT_EQ(begun, at_the_end) << "it must not run again";
  EXPECT_EQ(saver.TakeError(), nullptr);
}

TEST_F(SaverTest, MaintenanceContinuesAndItsFailureIsReported) {
  std::atomic<int> begun = 0;
  Saver saver(&*library_, 16, {}, [&](const std::atomic<bool>&) -> bool {
    if (++begun == 3) throw Error("no maintenance");
    return begun < 3;
  });
  ASSERT_TRUE(WaitUntil([&] { return begun >= 4; }));
  const std::exception_ptr error = saver.TakeError();
  ASSERT_NE(error, nullptr);
  EXPECT_THROW(std::rethrow_exception(error), Error);
}

TEST_F(SaverTest, ManyThreadsSubmitListAndLoadAtOnce) {
  const std::uint64_t first = library_->NewKey();
  for (int i = 1; i < 4; ++i) library_->NewKey();
  Saver saver(&*library_, 2);
  {
    std::vector<std::jthread> threads;
    for (std::uint64_t key = first; key < first + 4; ++key) {
      threads.emplace_back([&, key] {
        for (std::uint64_t round = 0; round < 10; ++round) {
          saver.Submit(
              {key, "Map " + std::to_string(key), Policy::kOpen, MakeSampleMap(100 * key + round), nullptr});
          for (const MapInfo& info : library_->List()) library_->Load(info.key);
        }
      });
    }
  }
  saver.Flush();
  EXPECT_EQ(saver.TakeError(), nullptr);
  for (std::uint64_t key = first; key < first + 4; ++key) {
    EXPECT_EQ(FirstDifference(*library_->Load(key).snapshot, *MakeSampleMap(100 * key + 9)), "");
  }
}

}  // namespace
}  // namespace docent::maps

// SPDX-License-Identifier: Apache-2.0
#include "maps/library/map_pager.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <atomic>

#include "engine/base/error.h"
#include "tests/maps/map_samples.h"
#include "tests/support/wait_until.h"

namespace docent::maps {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A library of maps of equal size with keys from 1 on, opened read-only, and an index of it.
class Pager : public ::testing::Test {
 protected:
  void MakeLibrary(int maps) {
    {
      Library library = OpenToWrite(folder_ / "a.docent");
      for (int i = 0; i < maps; ++i) {
        const std::uint64_t key = library.NewKey();
        library.Save({key, "map " + std::to_string(key), Policy::kOpen, MapOf(key), nullptr});
      }
    }
    LibraryOptions options;
    options.load_threads = 1;
    library_.emplace(Library::Open(folder_ / "a.docent", Access::kReadOnly, CreateIfMissing::kNo, options));
    map_bytes_ = BytesOf(*library_->Load(1).snapshot);
  }
  static std::shared_ptr<engine::MapSnapshot> MapOf(std::uint64_t key) {
    return MakeSampleMap(1000 * key, {.keyframes = 2, .points = 10});
  }
  // The thumbnail of a camera at the pose of a map's first keyframe.
  static engine::SmallBlurryImage ViewOf(std::uint64_t key) {
    return engine::MakeSmallBlurryImage(MapOf(key)->keyframes[0].features->levels[0]);
  }
  PagerOptions Options(double maps_that_fit) const {
    PagerOptions options;
    options.budget_bytes = static_cast<std::size_t>(maps_that_fit * static_cast<double>(map_bytes_));
    options.read_at_start_bytes = 0;
    return options;
  }

  TemporaryFolder folder_;
  std::optional<Library> library_;
  engine::PlaceIndex index_;
  std::size_t map_bytes_ = 0;
};

TEST_F(Pager, LoadsASmallLibraryCompletelyOnOpening) {
  MakeLibrary(3);
  MapPager pager(&*library_, &index_, {}, {});
  EXPECT_EQ(pager.Open().size(), 3u);
  EXPECT_EQ(pager.maps_in_memory().size(), 3u);
}

TEST_F(Pager, ReadsOnlyTheIndexOfALargeLibrary) {
  MakeLibrary(3);
  MapPager pager(&*library_, &index_, Options(2), {});
  pager.Open();
  EXPECT_TRUE(pager.maps_in_memory().empty());
  EXPECT_EQ(index_.keyframes(), 6u);
}

TEST_F(Pager, LoadsAMapInViewAndEvictsTheLeastRecentlyUsed) {
  MakeLibrary(6);
  std::vector<std::uint64_t> read, gone;
  MapPager::Callbacks callbacks;
  callbacks.loaded = [&](const StoredMap& map) { read.push_back(map.info.key); };
  callbacks.evict = [&](std::uint64_t key) {
    gone.push_back(key);
    return true;
  };
  MapPager pager(&*library_, &index_, Options(2.5), callbacks);
  pager.Open();
  for (const std::uint64_t key : {1, 2, 1, 3, 1, 4}) {
    const auto found = pager.FindPlaces(ViewOf(key), 1, 1, 0);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].map_key, key);
    ASSERT_NE(found[0].map, nullptr);
    EXPECT_EQ(FirstDifference(*found[0].map, *MapOf(key)), "");
    EXPECT_LE(pager.bytes_in_memory(), 2.5 * static_cast<double>(map_bytes_));
  }
  EXPECT_THAT(read, ElementsAre(1, 2, 3, 4));
  EXPECT_THAT(gone, ElementsAre(2, 3));
  EXPECT_THAT(pager.maps_in_memory(), ElementsAre(4, 1));
}

TEST_F(Pager, StaysWithinTheBudgetOnATourOfManyMaps) {
  MakeLibrary(120);
  MapPager pager(&*library_, &index_, Options(5), {});
  pager.Open();
  for (std::uint64_t key = 1; key <= 120; ++key) {
    const auto found = pager.FindPlaces(ViewOf(key), 4, 4, 0);
    ASSERT_FALSE(found.empty());
    EXPECT_EQ(found[0].map_key, key);
    EXPECT_LE(pager.bytes_in_memory(), 5 * map_bytes_ + map_bytes_ / 2);
  }
}

TEST_F(Pager, KeepsPinnedMapsAndMapsThatMayNotBeEvicted) {
  MakeLibrary(5);
  MapPager::Callbacks callbacks;
  callbacks.evict = [](std::uint64_t key) { return key != 2; };
  MapPager pager(&*library_, &index_, Options(2.5), callbacks);
  pager.Open();
  pager.Load(1);
  pager.Pin({1});
  for (const std::uint64_t key : {2, 3, 4, 5}) pager.Load(key);
  EXPECT_THAT(pager.maps_in_memory(), ElementsAre(5, 2, 1));
  pager.Pin({});
  pager.Load(3);
  EXPECT_THAT(pager.maps_in_memory(), ElementsAre(3, 2));
}

TEST_F(Pager, ReportsAnUnreadableMapOnceAndContinues) {
  MakeLibrary(3);
  sqlite3* connection = nullptr;
  ASSERT_EQ(sqlite3_open((folder_ / "a.docent").c_str(), &connection), SQLITE_OK);
  sqlite3_exec(connection, "DELETE FROM parts WHERE map_key = 2 AND part = 'points'", nullptr, nullptr,
               nullptr);
  sqlite3_close(connection);
  std::vector<std::string> problems;
  MapPager::Callbacks callbacks;
  callbacks.failed = [&](std::uint64_t, const std::string& problem) { problems.push_back(problem); };
  MapPager pager(&*library_, &index_, Options(2.5), callbacks);
  pager.Open();
  for (int i = 0; i < 3; ++i) {
    for (const auto& candidate : pager.FindPlaces(ViewOf(2), 3, 3, 0)) EXPECT_NE(candidate.map_key, 2u);
  }
  EXPECT_THAT(problems, ElementsAre(HasSubstr("map 'map 2' (2): its part 'points' is missing")));
  EXPECT_THROW(pager.Load(2), Error);
  EXPECT_EQ(pager.FindPlaces(ViewOf(3), 1, 1, 0).size(), 1u);
}

TEST_F(Pager, ReadsAMapAgainThatCouldNotBeReadForAWhile) {
  MakeLibrary(3);
  int failures_left = 2, problems = 0;
  MapPager::Callbacks callbacks;
  callbacks.loaded = [&](const StoredMap& map) {
    if (map.info.key == 2 && failures_left-- > 0) throw Error("the disk does not answer");
  };
  callbacks.failed = [&](std::uint64_t, const std::string&) { ++problems; };
  PagerOptions options = Options(2.5);
  options.first_retry = options.longest_retry = std::chrono::milliseconds(0);
  MapPager pager(&*library_, &index_, options, callbacks);
  pager.Open();
  for (int i = 0; i < 3; ++i) pager.FindPlaces(ViewOf(2), 1, 1, 0);
  EXPECT_THAT(pager.maps_in_memory(), ElementsAre(2));
  EXPECT_EQ(problems, 1) << "the same problem is reported once";
}

TEST_F(Pager, ReadsAnUnreadableMapAgainOnceItHasChanged) {
  MakeLibrary(3);
  bool is_damaged = true;
  MapPager::Callbacks callbacks;
  callbacks.loaded = [&](const StoredMap&) {
    if (is_damaged) throw Error("it is damaged");
  };
  MapPager pager(&*library_, &index_, Options(2.5), callbacks);
  pager.Open();
  EXPECT_TRUE(pager.FindPlaces(ViewOf(2), 1, 1, 0).empty());
  is_damaged = false;
  EXPECT_TRUE(pager.FindPlaces(ViewOf(2), 1, 1, 0).empty()) << "it is not read with every image";
  pager.MapHasChanged(2);
  EXPECT_EQ(pager.FindPlaces(ViewOf(2), 1, 1, 0).size(), 1u);
}

TEST_F(Pager, AMapThatIsRemovedWhileItIsReadIsNotFoundAgain) {
  MakeLibrary(3);
  bool removed = false;
  MapPager::Callbacks callbacks;
  callbacks.loaded = [&](const StoredMap& map) {
    if (map.info.key != 2) return;
    removed = true;
    index_.RemoveMap(2);
  };
  callbacks.exists = [&](std::uint64_t key) { return key != 2 || !removed; };
  MapPager pager(&*library_, &index_, Options(2.5), callbacks);
  pager.Open();
  for (const std::uint64_t key : {1, 2}) pager.FindPlaces(ViewOf(key), 1, 1, 0);
  EXPECT_TRUE(removed);
  EXPECT_EQ(index_.keyframes(), 4u);
  EXPECT_THAT(pager.maps_in_memory(), ElementsAre(1));
}

TEST_F(Pager, LoadsInTheBackgroundWhenQueriesMustNotWait) {
  MakeLibrary(6);
  PagerOptions options = Options(2.5);
  options.wait_for_maps = false;
  std::atomic<int> read = 0;
  MapPager::Callbacks callbacks;
  callbacks.loaded = [&](const StoredMap&) { ++read; };
  MapPager pager(&*library_, &index_, options, callbacks);
  pager.Open();
  for (const std::uint64_t key : {4, 5, 6, 4}) {
    // Repeated queries find it eventually, and a candidate always has its map.
    const auto is_found = [&] {
      bool found = false;
      for (const auto& candidate : pager.FindPlaces(ViewOf(key), 1, 1, 0)) {
        EXPECT_NE(candidate.map, nullptr);
        found |= candidate.map_key == key;
      }
      return found;
    };
    ASSERT_TRUE(WaitUntil(is_found)) << key;
  }
  const int before = read;
  pager.Prefetch({1});
  EXPECT_TRUE(WaitUntil([&] { return read > before; }));
}

}  // namespace
}  // namespace docent::maps

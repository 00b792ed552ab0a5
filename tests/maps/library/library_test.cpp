// SPDX-License-Identifier: Apache-2.0
#include "maps/library/library.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "engine/base/error.h"
#include "engine/vision/features.h"
#include "tests/maps/map_samples.h"

namespace docent::maps {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(Library, LoadsWhatWasSavedFieldByField) {
  const TemporaryFolder folder;
  const auto desk = MakeSampleMap(1);
  const auto door = MakeSampleMap(2, {.keyframes = 12, .points = 300});
  const auto scene = MakeSampleScene(7, 3);
  std::uint64_t desk_key = 0, door_key = 0;
  {
    Library library = OpenToWrite(folder / "a.docent");
    desk_key = library.NewKey();
    door_key = library.NewKey();
    library.Save({desk_key, "Desk", Policy::kOpen, desk, scene});
    library.Save({door_key, "Door", Policy::kAugmentOnly, door, nullptr});
    EXPECT_EQ(FirstDifference(*library.Load(desk_key).snapshot, *desk), "");
  }
  EXPECT_NE(desk_key, door_key);
  const Library library = OpenToRead(folder / "a.docent");
  const auto maps = library.List();
  ASSERT_EQ(maps.size(), 2u);
  EXPECT_EQ(maps[0].key, desk_key);
  EXPECT_EQ(maps[0].name, "Desk");
  EXPECT_EQ(maps[0].policy, Policy::kOpen);
  EXPECT_EQ(maps[1].name, "Door");
  EXPECT_EQ(maps[1].policy, Policy::kAugmentOnly);
  EXPECT_EQ(maps[1].keyframes, 12u);
  EXPECT_EQ(maps[1].points, 300u);
  EXPECT_EQ(maps[1].observations, door->observations.size());
  const StoredMap loaded_desk = library.Load(desk_key), loaded_door = library.Load(door_key);
  EXPECT_EQ(FirstDifference(*loaded_desk.snapshot, *desk), "");
  EXPECT_EQ(FirstDifference(*loaded_door.snapshot, *door), "");
  EXPECT_EQ(FirstDifference(loaded_desk.scene, *scene), "");
  EXPECT_TRUE(loaded_door.scene.text.empty());
  EXPECT_EQ(loaded_desk.info, maps[0]);
  EXPECT_EQ(library.FindByName("Door"), maps[1]);
  EXPECT_TRUE(library.Verify().empty());
}

TEST(Library, SharesOneCameraAmongItsKeyframes) {
  const TemporaryFolder folder;
  Library library = OpenToWrite(folder / "a.docent");
  const std::uint64_t key = library.NewKey();
  library.Save({key, "Desk", Policy::kOpen, MakeSampleMap(1, {.keyframes = 6}), nullptr});
  const auto loaded = library.Load(key).snapshot;
  EXPECT_EQ(loaded->keyframes[0].camera, loaded->keyframes[1].camera);
  EXPECT_NE(loaded->keyframes[0].camera, loaded->keyframes[2].camera);
  EXPECT_EQ(loaded->keyframes[2].camera, loaded->keyframes[5].camera);
}

TEST(Library, RecomputesFeaturesFromTheStoredImages) {
  const TemporaryFolder folder;
  const auto map = MakeSampleMap(3, {.keyframes = 5});
  Library library = Library::Open(folder / "a.docent", Access::kReadWrite, CreateIfMissing::kYes);
  const std::uint64_t key = library.NewKey();
  library.Save({key, "Desk", Policy::kOpen, map, nullptr});
  const auto loaded = library.Load(key).snapshot;
  for (std::size_t i = 0; i < loaded->keyframes.size(); ++i) {
    const auto expected = engine::MakeFeatures(map->keyframes[i].features->levels[0]);
    const engine::ImageFeatures& features = *loaded->keyframes[i].features;
    EXPECT_EQ(features.fast_threshold, expected->fast_threshold);
    for (int level = 0; level < engine::kPyramidLevels; ++level) {
      EXPECT_EQ(cv::norm(features.levels[level], expected->levels[level], cv::NORM_INF), 0);
      EXPECT_EQ(features.corners[level].size(), expected->corners[level].size());
    }
    EXPECT_EQ(cv::norm(features.small_blurry.pixels, expected->small_blurry.pixels, cv::NORM_INF), 0);
  }
}

TEST(Library, StoresAMapWithoutKeyframes) {
  const TemporaryFolder folder;
  Library library = OpenToWrite(folder / "a.docent");
  const std::uint64_t key = library.NewKey();
  library.Save({key, "Nothing yet", Policy::kOpen, nullptr, nullptr});
  EXPECT_TRUE(library.Load(key).snapshot->keyframes.empty());
  EXPECT_TRUE(library.Verify().empty());
}

TEST(Library, UpdatesAMapThatGrowsShrinksAndMoves) {
  const TemporaryFolder folder;
  Library library = OpenToWrite(folder / "a.docent");
  const std::uint64_t key = library.NewKey();
  auto map = MakeSampleMap(1);
  library.Save({key, "Desk", Policy::kOpen, map, nullptr});

  AddSampleKeyFrame(99, {5, 0, 0}, map.get());
  library.Save({key, "", Policy::kOpen, map, nullptr});
  EXPECT_EQ(FirstDifference(*library.Load(key).snapshot, *map), "");

  map->keyframes[0].camera_from_map.translation.x() += 0.25;
  map->points[4].point_in_map[1] -= 0.5;
  library.Save({key, "", Policy::kOpen, map, nullptr});
  EXPECT_EQ(FirstDifference(*library.Load(key).snapshot, *map), "");

  map->keyframes.pop_back();
  library.Save({key, "", Policy::kOpen, map, nullptr});
  EXPECT_EQ(FirstDifference(*library.Load(key).snapshot, *map), "");
  EXPECT_TRUE(library.Verify().empty());

  const auto other = MakeSampleMap(55);  // The same ids with other images.
  library.Save({key, "", Policy::kOpen, other, nullptr});
  EXPECT_EQ(FirstDifference(*library.Load(key).snapshot, *other), "");
  EXPECT_TRUE(library.Verify().empty());
}

TEST(Library, WritesLittleWhenOnlyPointsMoved) {
  const TemporaryFolder folder;
  Library library = OpenToWrite(folder / "a.docent");
  const std::uint64_t key = library.NewKey();
  const auto map = MakeSampleMap(1, {.keyframes = 4, .points = 20, .width_px = 640, .height_px = 480});
  library.Save({key, "Desk", Policy::kOpen, map, nullptr});
  const auto log = folder / "a.docent-wal";
  const auto before = std::filesystem::file_size(log);
  map->points[0].point_in_map[0] += 1;
  library.Save({key, "", Policy::kOpen, map, nullptr});
  const auto written = std::filesystem::file_size(log) - before;
  EXPECT_GT(written, 0u);
  EXPECT_LT(written, 64u << 10);  // Four noise images take about 500 KiB.
  library.Save({key, "", Policy::kOpen, map, nullptr});
  EXPECT_EQ(std::filesystem::file_size(log), before + written) << "an unchanged map must not be written";
}

TEST(Library, RecordsTheTimesOfCreationAndOfTheLastChange) {
  const TemporaryFolder folder;
  LibraryOptions options = QuickOptions();
  WallTime now{std::chrono::seconds(1000)};
  options.clock = [&now] { return now; };
  Library library = Library::Open(folder / "a.docent", Access::kReadWrite, CreateIfMissing::kYes, options);
  const std::uint64_t key = library.NewKey();
  library.Save({key, "Desk", Policy::kOpen, MakeSampleMap(1), nullptr});
  now += std::chrono::seconds(5);
  library.Save({key, "Desk", Policy::kOpen, MakeSampleMap(2), nullptr});
  EXPECT_EQ(library.Find(key).created, WallTime(std::chrono::seconds(1000)));
  EXPECT_EQ(library.Find(key).modified, WallTime(std::chrono::seconds(1005)));
}

TEST(Library, NeverReusesAKey) {
  const TemporaryFolder folder;
  std::uint64_t first = 0;
  {
    Library library = OpenToWrite(folder / "a.docent");
    first = library.NewKey();
    EXPECT_GE(first, 1u);
    library.Save({first, "Desk", Policy::kOpen, MakeSampleMap(1), nullptr});
    library.Remove(first);
    EXPECT_TRUE(library.List().empty());
    EXPECT_TRUE(library.Verify().empty());
  }
  Library library = OpenToWrite(folder / "a.docent");
  EXPECT_GT(library.NewKey(), first);
  EXPECT_THAT(ErrorOf([&] {
                library.Save({1000, "Desk", Policy::kOpen, MakeSampleMap(1), nullptr});
              }),
              HasSubstr("key was not issued"));
  EXPECT_THAT(ErrorOf([&] {
                library.Save({0, "Desk", Policy::kOpen, MakeSampleMap(1), nullptr});
              }),
              HasSubstr("has no key"));
}

TEST(Library, RejectsDuplicateAndInvalidNames) {
  const TemporaryFolder folder;
  Library library = OpenToWrite(folder / "a.docent");
  const std::uint64_t a = library.NewKey(), b = library.NewKey();
  library.Save({a, "Desk", Policy::kOpen, MakeSampleMap(1), nullptr});
  const MapRecord duplicate{b, "Desk", Policy::kOpen, MakeSampleMap(2), nullptr};
  EXPECT_THAT(ErrorOf([&] { library.Save(duplicate); }), HasSubstr("already a map named 'Desk'"));
  library.Save({b, "Door", Policy::kOpen, MakeSampleMap(2), nullptr});
  EXPECT_THAT(ErrorOf([&] { library.Rename(b, "Desk"); }), HasSubstr("already a map named 'Desk'"));
  EXPECT_THAT(ErrorOf([&] { library.Rename(b, ""); }), HasSubstr("name must have 1 to 200 bytes"));
  EXPECT_THAT(ErrorOf([&] { library.Rename(b, "two\nlines"); }), HasSubstr("name must have 1 to 200 bytes"));
  library.Rename(b, "Gr\xC3\xBCne T\xC3\xBCr");
  EXPECT_EQ(library.FindByName("Gr\xC3\xBCne T\xC3\xBCr").key, b);
  EXPECT_THAT(ErrorOf([&] { library.FindByName("Door"); }), HasSubstr("has no map named 'Door'"));
  EXPECT_THAT(ErrorOf([&] { library.Load(77); }), HasSubstr("has no map with the key 77"));
}

TEST(Library, AWaitingSaveDoesNotRevertANewNameOrPolicy) {
  const TemporaryFolder folder;
  Library library = OpenToWrite(folder / "a.docent");
  const std::uint64_t key = library.NewKey();
  library.Save({key, "Desk", Policy::kOpen, MakeSampleMap(1), nullptr});
  library.Rename(key, "Table");
  library.SetPolicy(key, Policy::kBounded);
  library.Save({key, "Desk", Policy::kOpen, nullptr, MakeSampleScene(1, 0)});
  EXPECT_EQ(library.Find(key).name, "Table");
  EXPECT_EQ(library.Find(key).policy, Policy::kBounded);
}

TEST(Library, StoresASharedAssetOnceUntilNoSceneUsesIt) {
  const TemporaryFolder folder;
  Library library = OpenToWrite(folder / "a.docent");
  const std::uint64_t a = library.NewKey(), b = library.NewKey();
  auto scene = std::make_shared<SceneRecord>();
  scene->text = "shared";
  scene->assets = {MakeSampleAsset(1, 200'000)};
  library.Save({a, "A", Policy::kOpen, MakeSampleMap(1), scene});
  auto by_id = std::make_shared<SceneRecord>(*scene);
  by_id->assets[0].bytes = nullptr;  // It is stored already.
  library.Save({b, "B", Policy::kOpen, MakeSampleMap(2), by_id});
  EXPECT_EQ(FirstDifference(library.LoadScene(b), *scene), "");

  library.Remove(a);
  EXPECT_EQ(FirstDifference(library.LoadScene(b), *scene), "");
  library.Save({b, "", Policy::kOpen, nullptr, std::make_shared<SceneRecord>()});
  EXPECT_TRUE(library.LoadScene(b).assets.empty());
  EXPECT_THAT(ErrorOf([&] {
                library.Save({b, "", Policy::kOpen, nullptr, by_id});
              }),
              HasSubstr("is not in the library"))
      << "the bytes were removed with the last scene";
  EXPECT_TRUE(library.Verify().empty());
}

TEST(Library, RejectsDifferentBytesForTheSameAssetId) {
  const TemporaryFolder folder;
  Library library = OpenToWrite(folder / "a.docent");
  const std::uint64_t key = library.NewKey();
  auto scene = std::make_shared<SceneRecord>();
  scene->assets = {MakeSampleAsset(1, 100)};
  library.Save({key, "A", Policy::kOpen, MakeSampleMap(1), scene});
  auto forged = std::make_shared<SceneRecord>(*scene);
  forged->text = "forged";
  forged->assets[0].bytes = MakeSampleAsset(2, 100).bytes;
  EXPECT_THAT(ErrorOf([&] {
                library.Save({key, "", Policy::kOpen, nullptr, forged});
              }),
              HasSubstr("has the id of another asset"));
  EXPECT_EQ(FirstDifference(library.LoadScene(key), *scene), "");
}

TEST(Library, RejectsAnInconsistentMapAndKeepsTheOldOne) {
  const TemporaryFolder folder;
  Library library = OpenToWrite(folder / "a.docent");
  const std::uint64_t key = library.NewKey();
  const auto good = MakeSampleMap(1);
  library.Save({key, "Desk", Policy::kOpen, good, nullptr});
  auto bad = std::make_shared<engine::MapSnapshot>(*good);
  bad->points[0].point_in_map[0] = std::nan("");
  const MapRecord record{key, "Desk", Policy::kOpen, bad, nullptr};
  EXPECT_THAT(ErrorOf([&] { library.Save(record); }), HasSubstr("point 0 has no valid position"));
  EXPECT_EQ(FirstDifference(*library.Load(key).snapshot, *good), "");
}

}  // namespace
}  // namespace docent::maps

// SPDX-License-Identifier: Apache-2.0
#include "engine/recognition/place_index.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <latch>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <thread>

#include "engine/base/random.h"
#include "engine/vision/features.h"

namespace docent::engine {
namespace {

SmallBlurryImage MakeThumbnail(std::uint64_t seed, int width = 80, int height = 60) {
  Random random(seed);
  SmallBlurryImage image;
  image.pixels.create(height, width, CV_32FC1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x)
      image.pixels.at<float>(y, x) = static_cast<float>(random.Uniform(-60, 60));
  }
  return image;
}

void AddKeyFrame(std::uint64_t seed, MapSnapshot* map, int width = 80, int height = 60) {
  auto features = std::make_shared<ImageFeatures>();
  features->small_blurry = MakeThumbnail(seed, width, height);
  KeyFrame keyframe;
  keyframe.id = map->next_keyframe++;
  keyframe.features = std::move(features);
  map->keyframes.push_back(std::move(keyframe));
}

std::shared_ptr<const MapSnapshot> MakeMap(std::uint64_t first_seed, int keyframes) {
  auto map = std::make_shared<MapSnapshot>();
  for (int i = 0; i < keyframes; ++i) AddKeyFrame(first_seed + static_cast<std::uint64_t>(i), map.get());
  return map;
}

// A thumbnail like that of a real scene, with structure as coarse as the usual blur.
SmallBlurryImage MakeScene(std::uint64_t seed, int width = 80, int height = 60) {
  SmallBlurryImage image = MakeThumbnail(seed, width, height);
  cv::GaussianBlur(image.pixels, image.pixels, {}, 2.5);
  image.pixels *= 10;
  return image;
}

// The same scene, shifted by `x` and `y` thumbnail pixels to the right and down.
SmallBlurryImage Shifted(std::uint64_t seed, int x, int y) {
  constexpr int kMargin = 24;
  SmallBlurryImage image = MakeScene(seed, 80 + 2 * kMargin, 60 + 2 * kMargin);
  image.pixels = image.pixels(cv::Rect(kMargin + x, kMargin + y, 80, 60)).clone();
  return image;
}

std::vector<KeyFrameThumbnail> ThumbnailsOf(const MapSnapshot& map) {
  std::vector<KeyFrameThumbnail> thumbnails;
  for (const auto& keyframe : map.keyframes)
    thumbnails.push_back({keyframe.id, Pack(keyframe.features->small_blurry)});
  return thumbnails;
}

TEST(PlaceIndex, FindsNothingWhenItIsEmpty) {
  const PlaceIndex index;
  EXPECT_TRUE(index.FindPlaces(MakeThumbnail(1), 5, 5, 0).empty());
  EXPECT_TRUE(index.FindPlaces(SmallBlurryImage(), 5, 5, 0).empty());
}

TEST(PlaceIndex, FindsEachKeyframeAmongManyDespiteNoise) {
  PlaceIndex index;
  std::vector<std::shared_ptr<const MapSnapshot>> maps;
  for (std::uint64_t key = 1; key <= 10; ++key) {
    auto map = std::make_shared<MapSnapshot>();
    for (std::uint64_t i = 0; i < 100; ++i) {
      auto features = std::make_shared<ImageFeatures>();
      features->small_blurry = MakeScene(1000 * key + i);
      KeyFrame keyframe;
      keyframe.id = map->next_keyframe++;
      keyframe.features = features;
      map->keyframes.push_back(keyframe);
    }
    maps.push_back(map);
    index.SetMap(key, map);
  }
  EXPECT_EQ(index.maps(), 10u);
  EXPECT_EQ(index.keyframes(), 1000u);
  for (std::uint64_t i = 0; i < 50; ++i) {
    const std::uint64_t key = 1 + i % 10;
    SmallBlurryImage seen = MakeScene(1000 * key + 2 * i);
    seen.pixels = 0.6 * seen.pixels + 0.3 * MakeScene(77'000 + i).pixels + 40;
    const auto found = index.FindPlaces(seen, 5, 5, 0);
    ASSERT_EQ(found.size(), 5u);
    EXPECT_EQ(found[0].map_key, key);
    EXPECT_EQ(found[0].keyframe, 2 * i);
    EXPECT_EQ(found[0].map, maps[key - 1]);
    for (std::size_t k = 1; k < found.size(); ++k) EXPECT_GE(found[k].difference, found[k - 1].difference);
  }
}

TEST(PlaceIndex, FindsAKeyframeByAShiftedImage) {
  PlaceIndex index;
  auto map = std::make_shared<MapSnapshot>();
  for (std::uint64_t i = 0; i < 600; ++i) {
    auto features = std::make_shared<ImageFeatures>();
    features->small_blurry = Shifted(i, 0, 0);
    KeyFrame keyframe;
    keyframe.id = map->next_keyframe++;
    keyframe.features = features;
    map->keyframes.push_back(keyframe);
  }
  index.SetMap(1, map);
  for (const auto& [x, y] : {std::pair{0, 0}, {12, 0}, {-12, 0}, {0, 8}, {5, -7}, {-11, 8}, {3, 1}}) {
    int right = 0;
    for (std::uint64_t i = 0; i < 600; i += 30) {
      const auto found = index.FindPlaces(Shifted(i, x, y), 1, 1, 0);
      right += found.size() == 1 && found[0].keyframe == i;
    }
    EXPECT_EQ(right, 20) << x << " " << y;
  }
}

TEST(PlaceIndex, FindsMapsThatAreNotInMemory) {
  PlaceIndex index;
  const auto map = MakeMap(1, 30);
  index.SetAppearance(4, ThumbnailsOf(*map));
  EXPECT_EQ(index.keyframes(), 30u);
  auto found = index.FindPlaces(MakeThumbnail(8), 1, 1, 0);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].map_key, 4u);
  EXPECT_EQ(found[0].keyframe, 7u);
  EXPECT_EQ(found[0].map, nullptr);
  index.SetMap(4, map);
  EXPECT_EQ(index.FindPlaces(MakeThumbnail(8), 1, 1, 0)[0].map, map);
  EXPECT_EQ(index.keyframes(), 30u);
  index.ReleaseMap(4);
  found = index.FindPlaces(MakeThumbnail(8), 1, 1, 4);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].keyframe, 7u);
  EXPECT_EQ(found[0].map, nullptr);
  EXPECT_EQ(map.use_count(), 1) << "the index must release the map";
  // The same map loaded from a file: other features, perhaps at the same addresses.
  index.SetMap(4, MakeMap(1, 30));
  EXPECT_EQ(index.FindPlaces(MakeThumbnail(8), 1, 1, 0)[0].keyframe, 7u);
}

TEST(PlaceIndex, IsInvariantToBrightnessAndContrast) {
  PlaceIndex index;
  index.SetMap(1, MakeMap(1, 10));
  SmallBlurryImage brighter = MakeThumbnail(4);
  brighter.pixels = 0.5 * brighter.pixels + 25;
  const auto found = index.FindPlaces(brighter, 1, 1, 0);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].keyframe, 3u);
  EXPECT_NEAR(found[0].difference, 0, 1);
}

TEST(PlaceIndex, ObeysTheLimitsPerMapAndInTotalAndTheRestrictionToOneMap) {
  PlaceIndex index;
  for (std::uint64_t key = 1; key <= 3; ++key) index.SetMap(key, MakeMap(100 * key, 20));
  const auto limited = index.FindPlaces(MakeThumbnail(7), 100, 2, 0);
  EXPECT_EQ(limited.size(), 6u);
  for (std::uint64_t key = 1; key <= 3; ++key) {
    EXPECT_EQ(
        std::count_if(limited.begin(), limited.end(), [&](const auto& hit) { return hit.map_key == key; }),
        2);
  }
  const auto here = index.FindPlaces(MakeThumbnail(7), 5, 100, 2);
  EXPECT_EQ(here.size(), 5u);
  for (const auto& hit : here) EXPECT_EQ(hit.map_key, 2u);
  EXPECT_TRUE(index.FindPlaces(MakeThumbnail(7), 5, 5, 9).empty());
}

TEST(PlaceIndex, UpdatesAMapThatGrowsLosesKeyframesAndChangesAnImage) {
  PlaceIndex index;
  auto map = std::make_shared<MapSnapshot>();
  for (int i = 0; i < 200; ++i) {
    AddKeyFrame(static_cast<std::uint64_t>(i), map.get());
    auto published = std::make_shared<const MapSnapshot>(*map);
    index.SetMap(1, published);
    const auto found = index.FindPlaces(MakeThumbnail(static_cast<std::uint64_t>(i)), 1, 1, 0);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_EQ(found[0].keyframe, static_cast<KeyFrameId>(i));
    EXPECT_EQ(found[0].map, published);
    EXPECT_LT(found[0].difference, 1e-6);
  }
  map->keyframes.erase(map->keyframes.begin() + 50, map->keyframes.begin() + 150);
  auto features = std::make_shared<ImageFeatures>();
  features->small_blurry = MakeThumbnail(5000);
  map->keyframes[10].features = features;
  index.SetMap(1, std::make_shared<const MapSnapshot>(*map));
  EXPECT_EQ(index.keyframes(), 100u);
  EXPECT_GT(index.FindPlaces(MakeThumbnail(60), 1, 1, 0)[0].difference, 100) << "keyframe 60 was removed";
  EXPECT_GT(index.FindPlaces(MakeThumbnail(10), 1, 1, 0)[0].difference, 100) << "its image has changed";
  EXPECT_EQ(index.FindPlaces(MakeThumbnail(5000), 1, 1, 0)[0].keyframe, 10u);
  index.RemoveMap(1);
  EXPECT_EQ(index.maps(), 0u);
  EXPECT_TRUE(index.FindPlaces(MakeThumbnail(5000), 1, 1, 0).empty());
}

TEST(PlaceIndex, IgnoresThumbnailsOfAnotherSize) {
  PlaceIndex index;
  auto map = std::make_shared<MapSnapshot>();
  AddKeyFrame(1, map.get(), 80, 60);
  AddKeyFrame(2, map.get(), 80, 45);
  AddKeyFrame(3, map.get(), 60, 80);  // The same number of pixels, another aspect ratio.
  index.SetMap(1, map);
  const auto found = index.FindPlaces(MakeThumbnail(9, 80, 45), 10, 10, 0);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].keyframe, 1u);
  EXPECT_EQ(index.FindPlaces(MakeThumbnail(9, 80, 60), 10, 10, 0).size(), 1u);
}

// The words of keyframe i of a map: twenty of its own and ten that all keyframes have.
WordBag WordsOfKeyFrame(std::uint64_t map, std::uint64_t i) {
  Random random(1000 * map + i);
  std::vector<std::uint32_t> leaves;
  for (std::uint32_t k = 0; k < 20; ++k) leaves.push_back(100 + random.Below(3900));
  for (std::uint32_t k = 0; k < 10; ++k) leaves.push_back(k);
  return MakeWordBag(leaves);
}
std::vector<KeyFrameWords> WordsOfMap(std::uint64_t key, const MapSnapshot& map) {
  std::vector<KeyFrameWords> words;
  for (const auto& keyframe : map.keyframes)
    words.push_back({keyframe.id, keyframe.id, WordsOfKeyFrame(key, keyframe.id)});
  return words;
}

TEST(PlaceIndex, FindsAPlaceByItsWordsWhenItsThumbnailIsUseless) {
  PlaceIndex index;
  for (std::uint64_t key = 1; key <= 8; ++key) {
    const auto map = MakeMap(100 * key, 50);
    index.SetAppearance(key, ThumbnailsOf(*map), WordsOfMap(key, *map));
  }
  const SmallBlurryImage unlike = MakeThumbnail(77'777), empty;
  int alone = 0;
  for (std::uint64_t key = 1; key <= 8; ++key) {
    for (std::uint64_t i = 0; i < 50; i += 7) {
      const WordBag words = WordsOfKeyFrame(key, i);
      for (const SmallBlurryImage* image : {&unlike, &empty}) {
        const auto found = index.FindPlaces({*image, words}, 3, 3, 0);
        ASSERT_FALSE(found.empty());
        EXPECT_EQ(found[0].map_key, key);
        EXPECT_EQ(found[0].keyframe, i);
        EXPECT_EQ(index.FindPlaces({*image, words}, 1, 1, key).at(0).keyframe, i);
      }
      const auto found = index.FindPlaces(unlike, 1, 1, 0);
      alone += found.at(0).map_key == key && found[0].keyframe == i;
    }
  }
  EXPECT_LE(alone, 1);
}

TEST(PlaceIndex, FindsKeyframesWithThumbnailsOfAnotherSizeByTheirWords) {
  PlaceIndex index;
  auto map = std::make_shared<MapSnapshot>();
  AddKeyFrame(1, map.get(), 80, 45);
  AddKeyFrame(2, map.get(), 80, 60);
  index.SetAppearance(1, ThumbnailsOf(*map), WordsOfMap(1, *map));
  const WordBag words = WordsOfKeyFrame(1, 0);
  for (const std::uint64_t only : {0, 1}) {
    const auto found = index.FindPlaces({MakeThumbnail(9, 80, 60), words}, 2, 2, only);
    ASSERT_EQ(found.size(), 2u);
    EXPECT_EQ(found[0].keyframe, 0u);
  }
}

TEST(PlaceIndex, ReturnsDifferentPlacesFirst) {
  PlaceIndex index;
  const auto map = MakeMap(1, 30);
  std::vector<KeyFrameWords> words = WordsOfMap(1, *map);
  for (auto& of : words) of.place = of.keyframe / 10 * 10;
  index.SetAppearance(1, ThumbnailsOf(*map), words);
  // Similar to the keyframes 11, 12 and 13, in this order.
  SmallBlurryImage seen = MakeThumbnail(12);
  seen.pixels = seen.pixels + 0.8 * MakeThumbnail(13).pixels + 0.6 * MakeThumbnail(14).pixels;
  const auto found = index.FindPlaces(seen, 5, 5, 0);
  ASSERT_EQ(found.size(), 5u);
  EXPECT_EQ(found[0].keyframe, 11u);
  EXPECT_NE(found[1].keyframe / 10, found[2].keyframe / 10);
  EXPECT_NE(found[1].keyframe / 10, 1u);
  EXPECT_NE(found[2].keyframe / 10, 1u);
  EXPECT_EQ(found[3].keyframe, 12u);
  EXPECT_EQ(found[4].keyframe, 13u);
}

TEST(PlaceIndex, RemovesTheWordsOfRemovedMaps) {
  PlaceIndex index;
  const auto map = MakeMap(1, 20);
  index.SetAppearance(1, ThumbnailsOf(*map), WordsOfMap(1, *map));
  const std::size_t before = index.words();
  EXPECT_GT(before, 20u * 25);
  index.SetAppearance(2, ThumbnailsOf(*map), WordsOfMap(2, *map));
  EXPECT_GT(index.words(), before);
  // In memory, evicted, smaller, removed.
  index.SetMap(2, map);
  index.ReleaseMap(2);
  EXPECT_GT(index.words(), before);
  index.SetMap(2, std::make_shared<const MapSnapshot>());
  EXPECT_EQ(index.words(), before);
  index.RemoveMap(2);
  index.RemoveMap(2);
  EXPECT_EQ(index.words(), before);
  index.RemoveMap(1);
  EXPECT_EQ(index.words(), 0u);
}

// A map with images that have corners.
std::shared_ptr<MapSnapshot> MakeMapOfImages(std::uint64_t seed, std::uint64_t keyframes) {
  auto map = std::make_shared<MapSnapshot>();
  for (std::uint64_t i = 0; i < keyframes; ++i) {
    Random random(seed + i);
    cv::Mat coarse(24, 32, CV_8UC1), image;
    for (int y = 0; y < coarse.rows; ++y) {
      for (int x = 0; x < coarse.cols; ++x)
        coarse.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(random.Below(256));
    }
    cv::resize(coarse, image, {320, 240}, 0, 0, cv::INTER_CUBIC);
    KeyFrame keyframe;
    keyframe.id = map->next_keyframe++;
    keyframe.features = MakeFeatures(image);
    map->keyframes.push_back(keyframe);
  }
  return map;
}

TEST(PlaceIndex, DescribesKeyframesOnce) {
  PlaceIndex index;
  const auto map = MakeMapOfImages(1, 3);
  const auto described = index.DescribeNew(1, *map);
  ASSERT_EQ(described.size(), 3u);
  EXPECT_GT(described[0].words.size(), 20u);
  index.SetMap(1, map, described);
  const std::size_t words = index.words();
  EXPECT_TRUE(index.DescribeNew(1, *map).empty());
  EXPECT_EQ(index.FindPlaces({SmallBlurryImage(), described[1].words}, 1, 1, 0).at(0).keyframe, 1u);
  // One more keyframe, and the same ones read from a file again.
  const auto longer = MakeMapOfImages(1, 4);
  const auto news = index.DescribeNew(1, *longer);
  ASSERT_EQ(news.size(), 1u);
  EXPECT_EQ(news[0].keyframe, 3u);
  index.SetMap(1, longer);  // Computes the missing words itself.
  EXPECT_EQ(index.words(), words + news[0].words.size());
  // Stored words are used as they are; missing ones are computed when the map is in memory.
  for (const bool stored : {true, false}) {
    PlaceIndex other;
    std::vector<KeyFrameWords> kept;
    if (stored) kept = described;
    for (auto& of : kept) of.place = of.keyframe;
    other.SetAppearance(1, ThumbnailsOf(*map), kept);
    EXPECT_EQ(other.words(), stored ? words : 0u);
    EXPECT_EQ(other.DescribeNew(1, *MakeMapOfImages(1, 3)).size(), stored ? 0u : 3u);
    other.SetMap(1, MakeMapOfImages(1, 3));
    EXPECT_EQ(other.words(), words);
    EXPECT_EQ(other.FindPlaces({SmallBlurryImage(), described[2].words}, 1, 1, 0).at(0).keyframe, 2u);
  }
}

TEST(PlaceIndex, FindsRolledImagesByWordsWhereThumbnailsFail) {
  PlaceIndex index;
  const auto map = MakeMapOfImages(1, 60);
  index.SetMap(1, map);
  int by_thumbnails = 0, merged = 0;
  for (std::uint64_t i = 0; i < 60; i += 3) {
    cv::Mat rolled;
    const cv::Mat turn = cv::getRotationMatrix2D({160, 120}, 50, 1);
    cv::warpAffine(map->keyframes[i].features->levels[0], rolled, turn, {320, 240});
    const auto features = MakeFeatures(rolled);
    const WordBag words = MakeWordBag(*features);
    by_thumbnails += index.FindPlaces(features->small_blurry, 1, 1, 0).at(0).keyframe == i;
    merged += index.FindPlaces({features->small_blurry, words}, 1, 1, 0).at(0).keyframe == i;
  }
  EXPECT_GE(merged, 19);
  EXPECT_LE(by_thumbnails, 6);
}

TEST(PlaceIndex, CanBeSearchedWhileMapsAreAddedExtendedAndRemoved) {
  PlaceIndex index;
  const auto map = MakeMap(0, 30);
  index.SetAppearance(1, ThumbnailsOf(*map), WordsOfMap(1, *map));
  const SmallBlurryImage seen = MakeThumbnail(11);
  const WordBag words = WordsOfKeyFrame(1, 11);
  std::atomic<bool> done = false;
  std::atomic<int> wrong = 0;
  std::latch reading(2);  // without it, the changes may be over before the first search
  std::vector<std::jthread> readers;
  for (int r = 0; r < 2; ++r) {
    readers.emplace_back([&, r] {
      reading.count_down();
      do {
        // With words and without.
        const PlaceQuery query = r == 0 ? PlaceQuery(seen) : PlaceQuery(seen, words);
        const auto found = index.FindPlaces(query, 3, 3, 0);
        if (found.empty() || found[0].map_key != 1 || found[0].keyframe != 11 || found[0].difference > 1e-6)
          ++wrong;
      } while (!done);
    });
  }
  reading.wait();
  auto growing = std::make_shared<MapSnapshot>();
  for (int i = 0; i < 150; ++i) {
    AddKeyFrame(10'000 + static_cast<std::uint64_t>(i), growing.get());
    index.SetMap(2, std::make_shared<const MapSnapshot>(*growing));
    const auto other = MakeMap(20'000, 3);
    if (i % 10 == 0) index.SetAppearance(3, ThumbnailsOf(*other), WordsOfMap(3, *other));
    if (i % 10 == 5) index.RemoveMap(3);
  }
  done = true;
  readers.clear();
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace docent::engine

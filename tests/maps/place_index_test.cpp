// SPDX-License-Identifier: Apache-2.0
#include "maps/place_index.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <opencv2/core.hpp>
#include <thread>

#include "engine/base/random.h"

namespace docent::maps {
namespace {

using engine::KeyFrameId;
using engine::MapSnapshot;
using engine::SmallBlurryImage;

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
  auto features = std::make_shared<engine::ImageFeatures>();
  features->small_blurry = MakeThumbnail(seed, width, height);
  engine::KeyFrame keyframe;
  keyframe.id = map->next_keyframe++;
  keyframe.features = std::move(features);
  map->keyframes.push_back(std::move(keyframe));
}

std::shared_ptr<const MapSnapshot> MakeMap(std::uint64_t first_seed, int keyframes) {
  auto map = std::make_shared<MapSnapshot>();
  for (int i = 0; i < keyframes; ++i) AddKeyFrame(first_seed + static_cast<std::uint64_t>(i), map.get());
  return map;
}

// The definition, without any of the index's shortcuts.
double ZeroMeanDifference(const cv::Mat& a, const cv::Mat& b) {
  const double mean_a = cv::mean(a)[0], mean_b = cv::mean(b)[0];
  double sum = 0;
  for (int y = 0; y < a.rows; ++y) {
    for (int x = 0; x < a.cols; ++x) {
      const double difference = (a.at<float>(y, x) - mean_a) - (b.at<float>(y, x) - mean_b);
      sum += difference * difference;
    }
  }
  return sum / static_cast<double>(a.total());
}

TEST(PlaceIndex, AnswersNothingWhenItKnowsNothing) {
  const PlaceIndex index;
  EXPECT_TRUE(index.FindPlaces(MakeThumbnail(1), 5, 5, 0).empty());
  EXPECT_TRUE(index.FindPlaces({}, 5, 5, 0).empty());
}

TEST(PlaceIndex, FindsTheSameKeyframesInTheSameOrderAsTheDefinition) {
  PlaceIndex index;
  std::vector<std::pair<std::uint64_t, std::shared_ptr<const MapSnapshot>>> maps;
  for (std::uint64_t key = 1; key <= 3; ++key) {
    maps.emplace_back(key, MakeMap(1000 * key, 150));
    index.SetMap(key, maps.back().second);
  }
  EXPECT_EQ(index.maps(), 3u);
  EXPECT_EQ(index.keyframes(), 450u);
  const SmallBlurryImage wanted = MakeThumbnail(5);
  std::vector<std::tuple<double, std::uint64_t, KeyFrameId>> all;
  for (const auto& [key, map] : maps) {
    for (const auto& keyframe : map->keyframes) {
      all.emplace_back(ZeroMeanDifference(wanted.pixels, keyframe.features->small_blurry.pixels), key,
                       keyframe.id);
    }
  }
  std::sort(all.begin(), all.end());
  const auto found = index.FindPlaces(wanted, 20, 20, 0);
  ASSERT_EQ(found.size(), 20u);
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_EQ(found[i].map_key, std::get<1>(all[i]));
    EXPECT_EQ(found[i].keyframe, std::get<2>(all[i]));
    EXPECT_EQ(found[i].map, maps[found[i].map_key - 1].second);
    EXPECT_NEAR(found[i].difference, std::get<0>(all[i]), 1e-4 * std::get<0>(all[i]));
  }
}

TEST(PlaceIndex, AddedBrightnessDoesNotMatter) {
  PlaceIndex index;
  index.SetMap(1, MakeMap(1, 10));
  SmallBlurryImage brighter = MakeThumbnail(4);
  brighter.pixels += 25;
  const auto found = index.FindPlaces(brighter, 1, 1, 0);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].keyframe, 3u);
  EXPECT_NEAR(found[0].difference, 0, 1e-6);
}

TEST(PlaceIndex, KeepsTheLimitsOfAMapAndOfTheWholeAndStaysInOneMapWhenAsked) {
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

TEST(PlaceIndex, FollowsAMapThatGrowsLosesKeyframesAndChangesAPicture) {
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
  auto features = std::make_shared<engine::ImageFeatures>();
  features->small_blurry = MakeThumbnail(5000);
  map->keyframes[10].features = features;
  index.SetMap(1, std::make_shared<const MapSnapshot>(*map));
  EXPECT_EQ(index.keyframes(), 100u);
  EXPECT_GT(index.FindPlaces(MakeThumbnail(60), 1, 1, 0)[0].difference, 100) << "keyframe 60 is gone";
  EXPECT_GT(index.FindPlaces(MakeThumbnail(10), 1, 1, 0)[0].difference, 100) << "its picture is another";
  EXPECT_EQ(index.FindPlaces(MakeThumbnail(5000), 1, 1, 0)[0].keyframe, 10u);
  index.RemoveMap(1);
  EXPECT_EQ(index.maps(), 0u);
  EXPECT_TRUE(index.FindPlaces(MakeThumbnail(5000), 1, 1, 0).empty());
}

TEST(PlaceIndex, PassesOverThumbnailsOfAnotherSize) {
  PlaceIndex index;
  auto map = std::make_shared<MapSnapshot>();
  AddKeyFrame(1, map.get(), 80, 60);
  AddKeyFrame(2, map.get(), 80, 45);
  AddKeyFrame(3, map.get(), 60, 80);  // as many pixels, another shape
  index.SetMap(1, map);
  const auto found = index.FindPlaces(MakeThumbnail(9, 80, 45), 10, 10, 0);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].keyframe, 1u);
  EXPECT_EQ(index.FindPlaces(MakeThumbnail(9, 80, 60), 10, 10, 0).size(), 1u);
}

TEST(PlaceIndex, IsSearchedWhileMapsComeGrowAndGo) {
  PlaceIndex index;
  index.SetMap(1, MakeMap(0, 30));
  std::atomic<bool> done = false;
  std::atomic<int> wrong = 0;
  std::vector<std::jthread> readers;
  for (int r = 0; r < 2; ++r) {
    readers.emplace_back([&] {
      while (!done) {
        const auto found = index.FindPlaces(MakeThumbnail(11), 3, 3, 0);
        if (found.empty() || found[0].map_key != 1 || found[0].keyframe != 11 || found[0].difference > 1e-6)
          ++wrong;
      }
    });
  }
  auto growing = std::make_shared<MapSnapshot>();
  for (int i = 0; i < 150; ++i) {
    AddKeyFrame(10'000 + static_cast<std::uint64_t>(i), growing.get());
    index.SetMap(2, std::make_shared<const MapSnapshot>(*growing));
    if (i % 10 == 0) index.SetMap(3, MakeMap(20'000, 3));
    if (i % 10 == 5) index.RemoveMap(3);
  }
  done = true;
  readers.clear();
  EXPECT_EQ(wrong, 0);
}

}  // namespace
}  // namespace docent::maps

// SPDX-License-Identifier: Apache-2.0
#include "engine/recognition/place_ranking.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace docent::engine {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr ChanceLevel kChance{};

// A score whose thumbnails have this correlation.
PlaceScore ScoreOf(std::uint64_t map, KeyFrameId place, double correlation, double words = 0) {
  return {map, place, 2 * 32.0 * 32.0 * (1 - correlation), words};
}

TEST(PlaceRanking, TheBestKeyframesOfDifferentPlacesComeFirst) {
  const std::vector<PlaceScore> scores = {ScoreOf(1, 0, 0.9), ScoreOf(1, 0, 0.95), ScoreOf(1, 7, 0.5),
                                          ScoreOf(2, 0, 0.6), ScoreOf(1, 7, 0.4)};
  EXPECT_THAT(RankPlaces(scores, kChance, 10, 10), ElementsAre(1, 3, 2, 0, 4));
  EXPECT_THAT(RankPlaces(scores, kChance, 3, 10), ElementsAre(1, 3, 2));
}

TEST(PlaceRanking, AfterFiveDifferentPlacesTheMostSimilarFollow) {
  std::vector<PlaceScore> scores;
  for (KeyFrameId place = 0; place < 7; ++place) {
    scores.push_back(ScoreOf(1, place, 0.9 - 0.1 * place));
    scores.push_back(ScoreOf(1, place, 0.85 - 0.1 * place));
  }
  EXPECT_THAT(RankPlaces(scores, kChance, 9, 9), ElementsAre(0, 2, 4, 6, 8, 1, 3, 5, 7));
  EXPECT_THAT(RankPlaces(scores, kChance, 12, 12), ElementsAre(0, 2, 4, 6, 8, 1, 3, 5, 7, 9, 10, 11));
}

TEST(PlaceRanking, IgnoresPlacesWhenAsked) {
  const std::vector<PlaceScore> scores = {ScoreOf(1, 0, 0.9), ScoreOf(1, 0, 0.95), ScoreOf(1, 7, 0.5),
                                          ScoreOf(2, 0, 0.6), ScoreOf(1, 7, 0.4)};
  EXPECT_THAT(RankPlaces(scores, kChance, 10, 10, 0), ElementsAre(1, 0, 3, 2, 4));
}

TEST(PlaceRanking, ObeysTheLimitsPerMapAndInTotal) {
  const std::vector<PlaceScore> scores = {ScoreOf(1, 0, 0.9), ScoreOf(1, 1, 0.8), ScoreOf(1, 2, 0.7),
                                          ScoreOf(2, 0, 0.6), ScoreOf(2, 0, 0.5)};
  EXPECT_THAT(RankPlaces(scores, kChance, 10, 2), ElementsAre(0, 1, 3, 4));
  EXPECT_THAT(RankPlaces(scores, kChance, 3, 1), ElementsAre(0, 3));
  EXPECT_THAT(RankPlaces(scores, kChance, 0, 1), IsEmpty());
  EXPECT_THAT(RankPlaces({}, kChance, 5, 5), IsEmpty());
}

TEST(PlaceRanking, EitherMethodCanDecide) {
  EXPECT_NEAR(PlaceSimilarity(ScoreOf(1, 0, 0.5, 0.3), kChance), 0.5 + 2, 1e-12);
  EXPECT_GT(PlaceSimilarity(ScoreOf(1, 0, 0.5, 0.2), kChance),
            PlaceSimilarity(ScoreOf(1, 0, 0.5, 0.15), kChance));
  EXPECT_GT(PlaceSimilarity(ScoreOf(1, 0, 0.6, 0.2), kChance),
            PlaceSimilarity(ScoreOf(1, 0, 0.5, 0.2), kChance));
  // A roll destroys the thumbnail's similarity; a negative correlation says no more than none.
  EXPECT_EQ(PlaceSimilarity(ScoreOf(1, 0, -0.8, 0.3), kChance),
            PlaceSimilarity(ScoreOf(1, 0, 0, 0.3), kChance));
  // Similarity at chance level does not count.
  const ChanceLevel many = {.correlation = 0.6, .words = 0.2};
  EXPECT_NEAR(PlaceSimilarity(ScoreOf(1, 0, 0.8, 0.3), many), 0.5 + 0.5, 1e-12);
  EXPECT_NEAR(PlaceSimilarity(ScoreOf(1, 0, 0.6, 0.2), many), 0, 1e-12);
  // When only words at chance level are shared, thumbnails alone decide.
  EXPECT_EQ(PlaceSimilarity(ScoreOf(1, 0, 0.5, 0.05), kChance),
            PlaceSimilarity(ScoreOf(1, 0, 0.5, 0.09), kChance));
}

}  // namespace
}  // namespace docent::engine

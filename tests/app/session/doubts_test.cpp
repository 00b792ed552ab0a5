// SPDX-License-Identifier: Apache-2.0
#include "app/session/doubts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace docent::app {
namespace {

using engine::Doubt;
using engine::Verdict;
using ::testing::HasSubstr;

std::string NameOf(std::uint64_t key) {
  return key == 1 ? "Elephants" : "Whales";
}

TEST(Doubts, TellAReasonOnceWhileItLasts) {
  Doubts doubts;
  int told = 0;
  for (int i = 0; i < 300; ++i)
    told += doubts.See(FromSeconds(i / 30.0), false,
                       {.doubt = Doubt::kOneCorner, .map_key = 1, .inliers = 40 + i}, NameOf);
  EXPECT_EQ(told, 1);
  EXPECT_THAT(doubts.words(), HasSubstr("40 points of Elephants"));
  EXPECT_THAT(doubts.words(), HasSubstr("corner"));
}

TEST(Doubts, TellNoMoreThanOneReasonASecondHoweverTheyChange) {
  Doubts doubts;
  int told = 0;
  for (int i = 0; i < 300; ++i) {
    const Verdict verdict{.doubt = i % 2 == 0 ? Doubt::kPoorFit : Doubt::kLookAlikes,
                          .map_key = 1,
                          .rival_key = i % 2 == 0 ? 0u : 2u};
    told += doubts.See(FromSeconds(i / 30.0), false, verdict, NameOf);
  }
  EXPECT_GT(told, 4);
  EXPECT_LE(told, 10);
}

TEST(Doubts, DoNotNameTheMapWhereTooLittleIsSeen) {
  Doubts doubts;
  int told = 0;
  for (int i = 0; i < 300; ++i)
    told += doubts.See(
        FromSeconds(i / 30.0), false,
        {.doubt = Doubt::kFewPoints, .map_key = static_cast<std::uint64_t>(i % 3), .inliers = 7}, NameOf);
  EXPECT_EQ(told, 1);
  EXPECT_THAT(doubts.words(), HasSubstr("too few"));
}

TEST(Doubts, AreOverOnceThereIsAPoseAndOnceNothingResemblesThePicture) {
  const Verdict alike{.doubt = Doubt::kLookAlikes, .map_key = 1, .rival_key = 2};
  Doubts doubts;
  EXPECT_TRUE(doubts.See(FromSeconds(0), false, alike, NameOf));
  EXPECT_THAT(doubts.words(), HasSubstr("Elephants or Whales"));
  doubts.See(FromSeconds(0.1), true, {}, NameOf);
  EXPECT_EQ(doubts.words(), "");
  EXPECT_FALSE(doubts.See(FromSeconds(0.2), false, alike, NameOf)) << "so soon after the last";
  EXPECT_TRUE(doubts.See(FromSeconds(1.2), false, alike, NameOf));
  doubts.See(FromSeconds(2.0), false, {}, NameOf);
  EXPECT_NE(doubts.words(), "") << "a sentence can be read";
  doubts.See(FromSeconds(3.0), false, {}, NameOf);
  EXPECT_EQ(doubts.words(), "");
}

TEST(Doubts, NameTheMapOnceOfWhichTwoPlacesLookAlike) {
  Doubts doubts;
  EXPECT_TRUE(
      doubts.See(FromSeconds(0), false, {.doubt = Doubt::kLookAlikes, .map_key = 1, .rival_key = 1}, NameOf));
  EXPECT_EQ(doubts.words(), "it may be one place in Elephants or another");
}

}  // namespace
}  // namespace docent::app

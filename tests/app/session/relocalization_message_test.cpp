// SPDX-License-Identifier: Apache-2.0
#include "app/session/relocalization_message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace docent::app {
namespace {

using engine::RejectionReason;
using engine::RelocalizationResult;
using ::testing::HasSubstr;

std::string NameOf(std::uint64_t key) {
  return key == 1 ? "Elephants" : "Whales";
}

TEST(RelocalizationMessage, TellAReasonOnceWhileItLasts) {
  RelocalizationMessage doubts;
  int told = 0;
  for (int i = 0; i < 300; ++i)
    told += doubts.See(FromSeconds(i / 30.0), false,
                       {.doubt = RejectionReason::kOneCorner, .map_key = 1, .inliers = 40 + i}, NameOf);
  EXPECT_EQ(told, 1);
  EXPECT_THAT(doubts.words(), HasSubstr("40 points of Elephants"));
  EXPECT_THAT(doubts.words(), HasSubstr("corner"));
}

TEST(RelocalizationMessage, TellNoMoreThanOneReasonASecondHoweverTheyChange) {
  RelocalizationMessage doubts;
  int told = 0;
  for (int i = 0; i < 300; ++i) {
    const RelocalizationResult verdict{
        .doubt = i % 2 == 0 ? RejectionReason::kPoorFit : RejectionReason::kLookAlikes,
        .map_key = 1,
        .competitor_key = i % 2 == 0 ? 0u : 2u};
    told += doubts.See(FromSeconds(i / 30.0), false, verdict, NameOf);
  }
  EXPECT_GT(told, 4);
  EXPECT_LE(told, 10);
}

TEST(RelocalizationMessage, DoNotNameTheMapWhereTooLittleIsSeen) {
  RelocalizationMessage doubts;
  int told = 0;
  for (int i = 0; i < 300; ++i)
    told += doubts.See(
        FromSeconds(i / 30.0), false,
        {.doubt = RejectionReason::kFewPoints, .map_key = static_cast<std::uint64_t>(i % 3), .inliers = 7},
        NameOf);
  EXPECT_EQ(told, 1);
  EXPECT_THAT(doubts.words(), HasSubstr("too few"));
}

TEST(RelocalizationMessage, AreOverOnceThereIsAPoseAndOnceNothingResemblesTheImage) {
  const RelocalizationResult alike{.doubt = RejectionReason::kLookAlikes, .map_key = 1, .competitor_key = 2};
  RelocalizationMessage doubts;
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

TEST(RelocalizationMessage, NameTheMapOnceOfWhichTwoPlacesLookAlike) {
  RelocalizationMessage doubts;
  EXPECT_TRUE(doubts.See(FromSeconds(0), false,
                         {.doubt = RejectionReason::kLookAlikes, .map_key = 1, .competitor_key = 1}, NameOf));
  EXPECT_EQ(doubts.words(), "it may be one place in Elephants or another");
}

}  // namespace
}  // namespace docent::app

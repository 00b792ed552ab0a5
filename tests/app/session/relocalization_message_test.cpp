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

TEST(RelocalizationMessage, IsReportedOnceWhileTheReasonIsTheSame) {
  RelocalizationMessage message;
  int messages = 0;
  for (int i = 0; i < 300; ++i)
    messages +=
        message.Update(FromSeconds(i / 30.0), false,
                       {.rejection = RejectionReason::kClustered, .map_key = 1, .inliers = 40 + i}, NameOf);
  EXPECT_EQ(messages, 1);
  EXPECT_THAT(message.text(), HasSubstr("Elephants"));
  EXPECT_THAT(message.text(), HasSubstr("corner"));
}

TEST(RelocalizationMessage, ChangesAtMostOncePerSecond) {
  RelocalizationMessage message;
  int messages = 0;
  for (int i = 0; i < 300; ++i) {
    const RelocalizationResult result{
        .rejection = i % 2 == 0 ? RejectionReason::kPoorFit : RejectionReason::kAmbiguous,
        .map_key = 1,
        .competitor_key = i % 2 == 0 ? 0u : 2u};
    messages += message.Update(FromSeconds(i / 30.0), false, result, NameOf);
  }
  EXPECT_GT(messages, 4);
  EXPECT_LE(messages, 10);
}

TEST(RelocalizationMessage, DoesNotNameTheMapWhenThereAreFewInliers) {
  RelocalizationMessage message;
  int messages = 0;
  for (int i = 0; i < 300; ++i)
    messages += message.Update(FromSeconds(i / 30.0), false,
                               {.rejection = RejectionReason::kFewPoints,
                                .map_key = static_cast<std::uint64_t>(i % 3),
                                .inliers = 7},
                               NameOf);
  EXPECT_EQ(messages, 1);
  EXPECT_THAT(message.text(), HasSubstr("don't recognize"));
}

TEST(RelocalizationMessage, NamesTheReasonInTheEnginesTermsForTheLog) {
  EXPECT_EQ(ReasonOf({RejectionReason::kFewPoints, "", ""}, 12), "too few inliers (12)");
  EXPECT_EQ(ReasonOf({RejectionReason::kAmbiguous, "Elephants", "Whales"}, 31),
            "ambiguous: Elephants or Whales (31 inliers)");
  EXPECT_EQ(ReasonOf({RejectionReason::kUnconfirmed, "Whales", ""}, 40),
            "not confirmed yet: Whales (40 inliers)");
}

TEST(RelocalizationMessage, IsClearedByAPoseAndWhenNothingResemblesTheImage) {
  const RelocalizationResult alike{
      .rejection = RejectionReason::kAmbiguous, .map_key = 1, .competitor_key = 2};
  RelocalizationMessage message;
  EXPECT_TRUE(message.Update(FromSeconds(0), false, alike, NameOf));
  EXPECT_THAT(message.text(), HasSubstr("Elephants or Whales"));
  message.Update(FromSeconds(0.1), true, {}, NameOf);
  EXPECT_EQ(message.text(), "");
  EXPECT_FALSE(message.Update(FromSeconds(0.2), false, alike, NameOf)) << "too soon after the last message";
  EXPECT_TRUE(message.Update(FromSeconds(1.2), false, alike, NameOf));
  message.Update(FromSeconds(2.0), false, {}, NameOf);
  EXPECT_NE(message.text(), "") << "a message stays long enough to be read";
  message.Update(FromSeconds(3.0), false, {}, NameOf);
  EXPECT_EQ(message.text(), "");
}

TEST(RelocalizationMessage, NamesTheMapOnceWhenTwoOfItsPlacesLookAlike) {
  RelocalizationMessage message;
  EXPECT_TRUE(message.Update(FromSeconds(0), false,
                             {.rejection = RejectionReason::kAmbiguous, .map_key = 1, .competitor_key = 1},
                             NameOf));
  EXPECT_EQ(message.text(), "This could be either of two places in Elephants. Move so that more is visible.");
}

}  // namespace
}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#include "app/session/visit_state.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace docent::app {

namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

TEST(VisitState, WelcomesAVisitorUntilAPlaceIsRecognized) {
  VisitState visit({"Lions", "Masks"});
  ui::VisitorDisplay display = visit.Update(7, "", "");
  EXPECT_TRUE(display.is_searching);
  EXPECT_THAT(display.sentence, HasSubstr("Welcome"));
  EXPECT_EQ(visit.Update(8, "", "Probably Lions; hold still").sentence, "Probably Lions; hold still");
  display = visit.Update(9, "Lions", "");
  EXPECT_FALSE(display.is_searching);
  EXPECT_EQ(display.place, "Lions");
  EXPECT_EQ(display.sentence, "");
}

TEST(VisitState, LetsTheWelcomeBeReadBeforeItSaysThatNothingIsRecognized) {
  const VisitTimes times;
  const VisitorStrings& strings = VisitorStringsFor("en");
  VisitState visit({"Lions", "Masks"});
  EXPECT_EQ(visit.Update(0, "", strings.not_recognized).sentence, strings.welcome);
  EXPECT_EQ(visit.Update(0.9 * times.welcome, "", strings.not_recognized).sentence, strings.welcome);
  EXPECT_TRUE(visit.Welcomes(0.9 * times.welcome));
  EXPECT_EQ(visit.Update(0.95 * times.welcome, "", "Probably Lions; hold still").sentence,
            "Probably Lions; hold still");
  EXPECT_EQ(visit.Update(1.1 * times.welcome, "", strings.not_recognized).sentence, strings.not_recognized);
  EXPECT_FALSE(visit.Welcomes(1.1 * times.welcome));
  visit.Update(6, "Lions", "");
  visit.Update(8, "", "");
  EXPECT_FALSE(visit.Welcomes(8)) << "who was somewhere knows what to do";
}

TEST(VisitState, ShowsTheEntrancesToAVisitorWhoIsNotRecognizedSoon) {
  const VisitTimes times;
  VisitState visit({"Lions", "Masks"});
  visit.Update(0, "", "");
  EXPECT_FALSE(visit.WantsEntrances(0.9 * times.entrances));
  EXPECT_TRUE(visit.WantsEntrances(1.1 * times.entrances));
  EXPECT_FALSE(visit.WantsViews(1.1 * times.entrances));
  EXPECT_FALSE(visit.WantsEntrances(1.1 * times.way_back)) << "then views that are like the image";
  EXPECT_TRUE(visit.WantsViews(1.1 * times.way_back));
  visit.Update(20, "Lions", "");
  visit.Update(22, "", "");
  EXPECT_FALSE(visit.WantsEntrances(22.1 + times.entrances)) << "who is lost knows the museum already";
  EXPECT_FALSE(VisitState({}).WantsEntrances(2));
}

TEST(VisitState, AnnouncesAPlaceOnceOnArrival) {
  const VisitTimes times;
  VisitState visit({"Lions", "Masks"});
  EXPECT_EQ(visit.Update(1, "Lions", "").arrival, 0);
  EXPECT_NEAR(visit.Update(1 + 0.5 * times.fade, "Lions", "").arrival, 0.5, 1e-9);
  EXPECT_EQ(visit.Update(1 + 0.5 * times.arrival, "Lions", "").arrival, 1);
  EXPECT_EQ(visit.Update(1.1 + times.arrival, "Lions", "").arrival, 0);
  // A short loss is no new arrival, another place is one.
  visit.Update(10, "", "");
  EXPECT_EQ(visit.Update(11, "Lions", "").arrival, 0);
  visit.Update(20, "Masks", "");
  EXPECT_EQ(visit.Update(21, "Masks", "").arrival, 1);
}

TEST(VisitState, HoldsContentForAMomentAfterALoss) {
  const VisitTimes times;
  VisitState visit({"Lions"});
  EXPECT_FALSE(visit.HoldsContent(0));
  visit.Update(1, "Lions", "");
  EXPECT_TRUE(visit.HoldsContent(1 + times.held));
  EXPECT_FALSE(visit.Update(1 + 0.9 * times.held, "", "Look around").is_searching);
  EXPECT_EQ(visit.Update(1 + 0.9 * times.held, "", "").place, "Lions");
  EXPECT_FALSE(visit.HoldsContent(1.01 + times.held));
  const ui::VisitorDisplay display = visit.Update(1.01 + times.held, "", "");
  EXPECT_TRUE(display.is_searching);
  EXPECT_EQ(display.place, "");
}

TEST(VisitState, HelpsMoreTheLongerAVisitorSearches) {
  const VisitTimes times;
  VisitState visit({"Lions", "Masks"});
  visit.Update(0, "Lions", "");
  EXPECT_THAT(visit.Update(1, "", "").sentence, Not(HasSubstr("Lions")));
  EXPECT_THAT(visit.Update(times.held + times.way_back, "", "").sentence, HasSubstr("Go back to Lions"));
  EXPECT_THAT(visit.Update(times.held + times.way_back, "", "").stops, IsEmpty());
  EXPECT_THAT(visit.Update(times.held + times.stops, "", "").stops, ElementsAre("Lions", "Masks"));
  EXPECT_FALSE(visit.WantsViews(times.held + 0.9 * times.way_back));
  EXPECT_TRUE(visit.WantsViews(times.held + times.way_back));
  EXPECT_FALSE(visit.WantsViews(times.held + times.stops));
  // Who was never recognized is helped as well.
  VisitState stranger({"Lions"});
  stranger.Update(5, "", "");
  EXPECT_THAT(stranger.Update(5 + times.stops, "", "").stops, ElementsAre("Lions"));
}

TEST(VisitState, SaysThatALibraryIsEmpty) {
  VisitState visit({});
  EXPECT_EQ(visit.Update(0, "", "hint").sentence, "There are no places to visit here yet.");
}

}  // namespace

}  // namespace docent::app

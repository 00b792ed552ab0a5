// SPDX-License-Identifier: Apache-2.0
#include "app/session/route_state.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/session/route_text.h"

namespace docent::app {

namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Kind = RouteEvent::Kind;
using Visit = RouteState::Visit;

constexpr std::uint64_t kHall = 99;  // A map that is no stop.

// Stops with the keys 1 to `count`, named A, B and so on.
Route RouteWith(std::size_t count) {
  Route route;
  for (std::size_t i = 0; i < count; ++i)
    route.stops.push_back({i + 1, std::string(1, static_cast<char>('A' + i))});
  return route;
}

// The visitor is in the map for long enough to have come there.
void Stay(std::uint64_t map_key, RouteState* state) {
  static double now = 0;
  constexpr double kStep_s = 0.5;
  state->Enter(map_key, now);
  for (double stayed = 0; stayed < RouteState::kStay_s; stayed += kStep_s)
    state->Enter(map_key, now += kStep_s);
}

std::vector<std::string> Texts(RouteState* state) {
  std::vector<std::string> texts;
  for (const RouteEvent& event : state->TakeEvents()) texts.push_back(TextOf(event, *state));
  return texts;
}

TEST(RouteState, LeadsFromStopToStop) {
  RouteState state(RouteWith(3));
  EXPECT_EQ(state.Target(), 0u);
  EXPECT_EQ(RouteLine(state), "3 stops. First: A");
  Stay(1, &state);
  Stay(1, &state);
  EXPECT_THAT(state.TakeEvents(), ElementsAre(RouteEvent{Kind::kArrived, 0}));
  EXPECT_EQ(state.Here(), 0u);
  EXPECT_EQ(RouteLine(state), "Stop 1 of 3. Next: B");
  state.Leave();
  EXPECT_EQ(state.Here(), std::nullopt);
  EXPECT_EQ(RouteLine(state), "Next: B, 2 of 3");
  Stay(kHall, &state);
  EXPECT_EQ(state.Here(), std::nullopt);
  Stay(2, &state);
  Stay(3, &state);
  EXPECT_THAT(Texts(&state), ElementsAre("arrived at 'B', stop 2 of 3", "arrived at 'C', stop 3 of 3",
                                         "finished; 3 of 3 stops seen"));
  EXPECT_EQ(state.Target(), std::nullopt);
  EXPECT_EQ(RouteLine(state), "The tour ends here. You saw all 3 stops.");
}

TEST(RouteState, SaysBeforeTheFirstStopHowLongTheTourTakes) {
  Route route = RouteWith(1);
  route.minutes = 20;
  RouteState state(route);
  EXPECT_EQ(RouteLine(state), "1 stop, about 20 minutes. First: A");
  Stay(1, &state);
  EXPECT_EQ(RouteLine(state), "The tour ends here. You saw its only stop.");
}

TEST(RouteState, ArrivesOnceAtEachStop) {
  RouteState state(RouteWith(3));
  Stay(1, &state);
  Stay(2, &state);
  state.TakeEvents();
  state.Leave();
  Stay(2, &state);
  Stay(1, &state);
  EXPECT_THAT(state.TakeEvents(), IsEmpty());
  EXPECT_EQ(RouteLine(state), "Stop 1 of 3. Next: C");
}

TEST(RouteState, StaysAtAStopWhileOneOfTwoCamerasHasAPose) {
  RouteState state(RouteWith(2));
  state.Enter(1, 0, 0);
  state.Leave(0.1, 1);
  EXPECT_EQ(state.Here(), 0u);
  EXPECT_FALSE(state.GoBack()) << "the visitor is at the first stop";
  state.Enter(1, 0.2, 1);
  state.Leave(0.3, 0);
  EXPECT_EQ(state.Here(), 0u) << "the other camera has a pose now";
  state.Leave(0.4, 1);
  EXPECT_EQ(state.Here(), std::nullopt);
  state.Enter(1, 5, 0);
  state.Leave(5.9, 1);
  EXPECT_EQ(state.Here(), 0u);
  state.Leave(6.1, 1);
  EXPECT_EQ(state.Here(), std::nullopt) << "the first camera has delivered no image since";
}

TEST(RouteState, DoesNotTakeTwoGlimpsesOfALaterStopForAStay) {
  RouteState state(RouteWith(3));
  state.Enter(1, 0);
  state.TakeEvents();
  state.Enter(3, 10);
  state.Leave();
  state.Enter(3, 20);
  EXPECT_THAT(state.TakeEvents(), IsEmpty()) << "nobody was there for ten seconds";
  for (double seconds = 20; seconds < 23; seconds += 0.5) state.Enter(3, seconds);
  EXPECT_THAT(state.TakeEvents(), IsEmpty());
  state.Enter(3, 23.1);
  EXPECT_THAT(Texts(&state), ElementsAre("skipped 'B', stop 2 of 3", "arrived at 'C', stop 3 of 3",
                                         "finished; 2 of 3 stops seen"));
}

TEST(RouteState, SkipsAStopOnRequest) {
  RouteState state(RouteWith(3));
  Stay(1, &state);
  EXPECT_TRUE(state.Skip());
  EXPECT_EQ(state.Target(), 2u);
  EXPECT_THAT(Texts(&state), ElementsAre("arrived at 'A', stop 1 of 3", "skipped 'B', stop 2 of 3"));
  EXPECT_TRUE(state.Skip());
  EXPECT_THAT(Texts(&state), ElementsAre("skipped 'C', stop 3 of 3", "finished; 1 of 3 stops seen"));
  EXPECT_EQ(RouteLine(state), "The tour ends here. You saw 1 of 3 stops.");
  EXPECT_FALSE(state.Skip());
  EXPECT_THAT(state.TakeEvents(), IsEmpty());
}

TEST(RouteState, HasSkippedTheStopsBeforeALaterOneWhereTheVisitorIsRecognized) {
  RouteState state(RouteWith(4));
  Stay(1, &state);
  Stay(4, &state);
  EXPECT_THAT(state.TakeEvents(), ElementsAre(RouteEvent{Kind::kArrived, 0}, RouteEvent{Kind::kSkipped, 1},
                                              RouteEvent{Kind::kSkipped, 2}, RouteEvent{Kind::kArrived, 3},
                                              RouteEvent{Kind::kFinished, 0}));
  // Who comes to a skipped stop after all has seen it.
  Stay(2, &state);
  EXPECT_THAT(state.TakeEvents(), ElementsAre(RouteEvent{Kind::kArrived, 1}));
  EXPECT_EQ(state.CountSeen(), 3u);
  EXPECT_EQ(state.visit(2), Visit::kSkipped);
  EXPECT_THAT(RouteList(state), ElementsAre("1. A (seen)", "2. B (seen)", "3. C (skipped)", "4. D (seen)"));
}

TEST(RouteState, DoesNotCountALaterStopThatIsSeenForAMoment) {
  RouteState state(RouteWith(3));
  state.Enter(1, 0);
  state.Enter(3, 1);
  state.Enter(3, 0.9 + RouteState::kStay_s);
  EXPECT_EQ(state.Target(), 1u);
  state.Enter(1, 5);
  state.Enter(3, 6);
  EXPECT_EQ(state.Target(), 1u) << "each time counts for itself";
  state.Enter(2, 7);
  EXPECT_EQ(state.Target(), 2u) << "the next stop is reached at once";
}

TEST(RouteState, DoesNotCountALaterStopThroughWhichTheSignpostsLead) {
  Route route = RouteWith(4);
  // From A to B it goes through D.
  route.signposts.Add(1, 4);
  route.signposts.Add(4, 2);
  RouteState state(route);
  Stay(1, &state);
  EXPECT_EQ(state.SignpostsFrom(1), 2);
  Stay(4, &state);
  state.Leave();
  Stay(4, &state);
  EXPECT_EQ(state.Target(), 1u);
  Stay(2, &state);
  EXPECT_EQ(state.Target(), 2u);
  EXPECT_EQ(state.visit(3), Visit::kAhead);
  // From B no signpost leads there, so that this is an arrival.
  Stay(4, &state);
  EXPECT_EQ(state.visit(2), Visit::kSkipped);
  EXPECT_EQ(state.Target(), std::nullopt);
}

TEST(RouteState, CountsAStopOnTheWayOnceItIsTheNextOne) {
  Route route = RouteWith(3);
  route.signposts.Add(1, 3);
  route.signposts.Add(3, 2);
  RouteState state(route);
  Stay(1, &state);
  Stay(3, &state);
  EXPECT_EQ(state.Target(), 1u);
  state.Skip();
  Stay(3, &state);
  EXPECT_EQ(state.visit(2), Visit::kSeen);
  EXPECT_EQ(state.Target(), std::nullopt);
}

TEST(RouteState, LeadsBackToThePreviousStopAndOnAgain) {
  RouteState state(RouteWith(4));
  EXPECT_FALSE(state.GoBack()) << "nothing is before the first stop";
  Stay(1, &state);
  EXPECT_FALSE(state.GoBack()) << "the visitor is at the first stop";
  Stay(2, &state);
  Stay(3, &state);
  state.TakeEvents();
  EXPECT_TRUE(state.GoBack());
  EXPECT_EQ(state.Target(), 1u) << "not the stop where the visitor is";
  EXPECT_EQ(RouteLine(state), "Back to B, 2 of 4");
  EXPECT_TRUE(state.GoBack());
  EXPECT_EQ(state.Target(), 0u);
  Stay(2, &state);
  EXPECT_EQ(state.Target(), 0u) << "only the way there";
  Stay(1, &state);
  EXPECT_EQ(state.Target(), 3u);
  EXPECT_THAT(Texts(&state), ElementsAre("going back to 'B', stop 2 of 4", "going back to 'A', stop 1 of 4",
                                         "arrived at 'A', stop 1 of 4"));
}

TEST(RouteState, LeadsOnFromTheWayBackWhenTheStopIsSkipped) {
  RouteState state(RouteWith(3));
  Stay(1, &state);
  state.Leave();
  EXPECT_TRUE(state.GoBack());
  EXPECT_EQ(state.Target(), 0u) << "the visitor has left the first stop";
  state.TakeEvents();
  EXPECT_TRUE(state.Skip());
  EXPECT_EQ(state.Target(), 1u);
  EXPECT_THAT(Texts(&state), ElementsAre("going on to 'B', stop 2 of 3"));
}

TEST(RouteState, LeadsBackAfterTheEnd) {
  RouteState state(RouteWith(2));
  Stay(1, &state);
  Stay(2, &state);
  EXPECT_TRUE(state.GoBack());
  EXPECT_EQ(state.Target(), 0u);
  state.TakeEvents();
  Stay(1, &state);
  EXPECT_EQ(state.Target(), std::nullopt);
  EXPECT_THAT(state.TakeEvents(), ElementsAre(RouteEvent{Kind::kArrived, 0})) << "the tour ends only once";
  Stay(1, &state);
  EXPECT_FALSE(state.HasReturned()) << "it is the same visitor";
}

TEST(RouteState, ForgetsTheWayBackAtANewStop) {
  RouteState state(RouteWith(3));
  Stay(1, &state);
  Stay(2, &state);
  state.GoBack();
  Stay(3, &state);
  EXPECT_FALSE(state.is_going_back());
  EXPECT_EQ(state.Target(), std::nullopt);
}

TEST(RouteState, HasReturnedWhenAFinishedTourIsAgainAtItsFirstStop) {
  RouteState state(RouteWith(2));
  EXPECT_FALSE(state.is_begun());
  Stay(1, &state);
  EXPECT_TRUE(state.is_begun());
  Stay(2, &state);
  Stay(kHall, &state);
  EXPECT_FALSE(state.HasReturned());
  state.Enter(1, 1e3);
  EXPECT_FALSE(state.HasReturned()) << "the first stop is seen for a moment";
  state.Enter(1, 1e3 + 0.9);
  state.Enter(1, 1e3 + 1.8);
  state.Enter(1, 1e3 + 2.7);
  state.Enter(1, 1e3 + 3.1);
  EXPECT_TRUE(state.HasReturned());
  EXPECT_TRUE(state.GoBack());
  EXPECT_FALSE(state.HasReturned()) << "the visitor asks to see the first stop again";
}

TEST(RouteState, HasNotReturnedWhereItEnds) {
  RouteState state(RouteWith(3));
  Stay(1, &state);
  Stay(2, &state);
  Stay(1, &state);
  EXPECT_TRUE(state.Skip());
  Stay(1, &state);
  EXPECT_EQ(state.Target(), std::nullopt);
  EXPECT_FALSE(state.HasReturned());
}

TEST(SignpostGraph, CountsTheFewestSignpostsToAMap) {
  SignpostGraph graph;
  graph.Add(1, 2);
  graph.Add(2, 3);
  graph.Add(3, 1);
  graph.Add(1, 4);
  graph.Add(4, 3);
  graph.Add(4, 4);
  const std::map<std::uint64_t, int> expected = {{3, 0}, {2, 1}, {4, 1}, {1, 2}};
  EXPECT_EQ(graph.DistancesTo(3), expected);
  EXPECT_EQ(graph.DistancesTo(7), (std::map<std::uint64_t, int>{{7, 0}}));
}

}  // namespace

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#include "app/session/visitor_guide.h"

#include <gtest/gtest.h>

#include "tests/app/support/simulated_session.h"

namespace docent::app {
namespace {

using namespace simulated_session;

TEST(VisitorGuide, KeepsTheViewsOfALostVisitorWhileImagesAreSkipped) {
  const auto simulation = Room(3);
  Session session(Options(Pace::kLockstep, "Desk"), LensOf(*simulation), nullptr);
  Feed(simulation, Pace::kLockstep, &session);
  VisitorGuide guide(&session, {"Desk"}, VisitorStringsFor("en"));
  cv::Mat image;
  simulation->Render(0, &image);
  const auto views_at = [&](double seconds, bool is_dropped) {
    const auto frame = std::make_shared<ShownFrame>();
    frame->seconds = seconds;
    frame->tracked.state = is_dropped ? engine::TrackingState::kDropped : engine::TrackingState::kLost;
    if (!is_dropped) frame->tracked.frame.image = image;
    guide.Guide(frame, simulation->camera());
    std::vector<std::string> names;
    for (const ui::KnownView& view : frame->visitor->views) names.push_back(view.name);
    return names;
  };
  const std::vector<std::string> none, desk = {"Desk"};
  EXPECT_EQ(views_at(0, false), none);
  EXPECT_EQ(views_at(6, false), desk);
  EXPECT_EQ(views_at(6.5, true), desk);
  EXPECT_EQ(views_at(7.5, true), desk) << "it is time for others, but there is no image to find them by";
  EXPECT_EQ(views_at(7.6, false), desk);
  EXPECT_EQ(views_at(40, false), none) << "now all places are listed";
}

TEST(VisitorGuide, SaysTheEndOfATourForAWhileInTheSentence) {
  const auto simulation = Room(3);
  Session session(Options(Pace::kLockstep, "Desk"), LensOf(*simulation), nullptr);
  Route route;
  route.stops = {{1, "Desk"}, {2, "Door"}};
  RouteState state(route);
  VisitorGuide guide(&session, {"Desk", "Door"}, VisitorStringsFor("en"), &state);
  const auto sentence_at = [&](double seconds, engine::Hint hint = engine::Hint::kNone) {
    const auto frame = std::make_shared<ShownFrame>();
    frame->seconds = seconds;
    frame->tracked.state = engine::TrackingState::kSixDof;
    frame->tracked.hint = hint;
    frame->tracked.map_key = 1;
    frame->shown.map_name = "Desk";
    guide.Guide(frame, simulation->camera());
    return frame->visitor->sentence;
  };
  EXPECT_EQ(sentence_at(0), "");
  ASSERT_TRUE(state.Skip());
  EXPECT_EQ(sentence_at(1), "The tour ends here. You saw 1 of 2 stops.");
  EXPECT_EQ(sentence_at(8, engine::Hint::kMoveMoreSlowly), "The tour ends here. You saw 1 of 2 stops.");
  EXPECT_EQ(sentence_at(10), "");
}

}  // namespace
}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#include "app/session/visitor_guide.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

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

TEST(VisitorGuide, TheOtherCameraThatIsLostTakesNoVisitorAway) {
  const auto simulation = Room(3);
  Session session(Options(Pace::kLockstep, "Desk"), LensOf(*simulation), nullptr);
  Route route;
  route.stops = {{1, "Desk"}, {2, "Door"}};
  RouteState state(route);
  VisitorGuide first(&session, {"Desk", "Door"}, VisitorStringsFor("en"), &state),
      second(&session, {"Desk", "Door"}, VisitorStringsFor("en"), &state);
  const auto tracked = std::make_shared<ShownFrame>(), lost = std::make_shared<ShownFrame>();
  tracked->tracked.state = engine::TrackingState::kSixDof;
  tracked->tracked.map_key = 1;
  tracked->shown.map_name = "Desk";
  lost->tracked.state = engine::TrackingState::kLost;
  lost->tracked.frame.camera = 1;
  lost->seconds = 3;  // Its first image was three seconds earlier.
  first.Guide(tracked, simulation->camera());
  second.Guide(lost, simulation->camera());
  EXPECT_EQ(state.Here(), 0u);
}

// A visitor at the first of two stops who looks at a label, with a machine that skips images.
class VisitorWithSkippedImages : public ::testing::Test {
 protected:
  VisitorWithSkippedImages() {
    content::Entity label;
    label.name = "lions";
    label.kind = content::Entity::Kind::kLabel;
    label.label.text = "Lions.";
    label.label.anchor = Eigen::Vector3d(0, 0, 2);
    auto scene = std::make_shared<content::Scene>();
    scene->entities = {label};
    scene_ = std::move(scene);
    Route route;
    route.stops = {{1, "Desk"}, {2, "Door"}};
    route_.emplace(route);
    guide_.emplace(&session_, std::vector<std::string>{"Desk", "Door"}, VisitorStringsFor("en"), &*route_,
                   "en", true);
  }
  std::shared_ptr<const ShownFrame> See(double seconds, engine::TrackingState state) {
    const engine::CameraModel camera(engine::LensModel::kRadialTangential, {640, 480, 500, 500, 319.5, 239.5},
                                     {});
    const auto frame = std::make_shared<ShownFrame>();
    frame->seconds = seconds;
    frame->tracked.state = state;
    if (engine::HasPose(state)) {
      frame->tracked.map_key = 1;
      frame->shown.map_name = "Desk";
      frame->shown.scene = scene_;
    }
    guide_->Guide(frame, camera);
    return frame;
  }

  const std::shared_ptr<const Simulation> simulation_ = Room(3);
  Session session_{Options(Pace::kLockstep, "Desk"), LensOf(*simulation_), nullptr};
  std::shared_ptr<const content::Scene> scene_;
  std::optional<RouteState> route_;
  std::optional<VisitorGuide> guide_;
};

TEST_F(VisitorWithSkippedImages, OpensByGazeWhatStaysInTheMiddle) {
  std::shared_ptr<const ShownFrame> frame;
  for (double seconds = 0; seconds < 3; seconds += 0.2) {
    frame = See(seconds, engine::TrackingState::kSixDof);
    See(seconds + 0.1, engine::TrackingState::kDropped);
  }
  ASSERT_TRUE(frame->visitor->card);
  EXPECT_EQ(frame->visitor->card->entity, "lions");
}

TEST_F(VisitorWithSkippedImages, CanOpenWhatWasInViewBefore) {
  See(0, engine::TrackingState::kSixDof);
  See(0.1, engine::TrackingState::kDropped);
  EXPECT_NO_THROW(guide_->cards()->Do({GuideVisitor::Step::kPress, {}}));
  const auto frame = See(0.2, engine::TrackingState::kSixDof);
  ASSERT_TRUE(frame->visitor->card);
  EXPECT_EQ(frame->visitor->card->entity, "lions");
}

TEST_F(VisitorWithSkippedImages, StaysAtAStopUntilTheCameraIsLost) {
  See(0, engine::TrackingState::kSixDof);
  See(0.1, engine::TrackingState::kDropped);
  EXPECT_EQ(route_->Here(), 0u);
  See(0.2, engine::TrackingState::kLost);
  EXPECT_EQ(route_->Here(), std::nullopt);
}

}  // namespace
}  // namespace docent::app

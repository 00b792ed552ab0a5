// SPDX-License-Identifier: Apache-2.0
#include "app/session/visitor_cards.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/base/error.h"

namespace docent::app {
namespace {

using ::testing::ElementsAre;
using Step = GuideVisitor::Step;

const engine::CameraModel kCardCamera(engine::LensModel::kRadialTangential,
                                      {640, 480, 500, 500, 319.5, 239.5}, {});

content::Entity LabelAt(const std::string& name, const std::string& text, const Eigen::Vector3d& place) {
  content::Entity entity;
  entity.name = name;
  entity.kind = content::Entity::Kind::kLabel;
  entity.label.text = text;
  entity.label.anchor = place;
  return entity;
}

// A visitor who stands at the origin of a map with three labels, of which the last has three pages.
struct CardVisitor {
  explicit CardVisitor(bool by_gaze = false) : cards(VisitorStringsFor("en"), "en", by_gaze) {
    auto made = std::make_shared<content::Scene>();
    std::string book;
    for (int i = 0; i < 12; ++i)
      book += "Sentence " + std::to_string(i) + " of " + std::string(50, 'x') + ". ";
    made->entities = {LabelAt("left", "Lions.", {-0.6, 0, 2}), LabelAt("middle", "Masks.", {0, 0, 2}),
                      LabelAt("right", book, {0.6, 0, 2})};
    scene = made;
  }

  // One frame, 1/30 s after the last one. The camera is turned by this angle about the vertical axis, to the
  // right; with a lost camera there is no pose.
  const ui::VisitorDisplay& See(double right_deg = 0, bool lost = false) {
    seconds += 1.0 / 30;
    frame.seconds = seconds;
    frame.tracked.map_key = 7;
    frame.tracked.state = lost ? engine::TrackingState::kLost : engine::TrackingState::kSixDof;
    frame.tracked.camera_from_map.rotation =
        engine::Rotation3::Exp(Eigen::Vector3d(0, -right_deg * std::numbers::pi / 180, 0));
    frame.shown.scene = lost ? nullptr : scene;
    frame.visitor.emplace();
    cards.Update(kCardCamera, &frame);
    return *frame.visitor;
  }
  const ui::VisitorDisplay& SeeFor(double duration_s, double right_deg = 0, bool lost = false) {
    for (const double end = seconds + duration_s; seconds < end;) See(right_deg, lost);
    return *frame.visitor;
  }
  std::string OpenName() const { return frame.visitor->card ? frame.visitor->card->entity : ""; }
  std::string MarkedName() const {
    return frame.visitor->marked ? frame.visitor->targets[*frame.visitor->marked].entity : "";
  }

  VisitorCards cards;
  std::shared_ptr<const content::Scene> scene;
  ShownFrame frame;
  double seconds = 0;
};

TEST(VisitorCards, TheOneButtonOpensWhatIsNearestToTheMiddleAndClosesIt) {
  CardVisitor visitor;
  visitor.See();
  EXPECT_EQ(visitor.MarkedName(), "middle");
  EXPECT_EQ(visitor.OpenName(), "");
  EXPECT_TRUE(visitor.cards.Do({Step::kPress}));
  visitor.See();
  ASSERT_EQ(visitor.OpenName(), "middle");
  EXPECT_EQ(visitor.frame.visitor->card->text, "Masks.");
  EXPECT_EQ(visitor.frame.visitor->card->hint, "Press to close.");
  visitor.cards.Do({Step::kPress});
  visitor.See();
  EXPECT_EQ(visitor.OpenName(), "");
}

TEST(VisitorCards, PagesFollowEachOtherUntilTheLastOneCloses) {
  CardVisitor visitor;
  visitor.See();
  visitor.cards.Do({Step::kOpen, "right"});
  std::string read;
  int pages = 0;
  for (visitor.See(); visitor.frame.visitor->card && pages < 20; visitor.See(), ++pages) {
    read += visitor.frame.visitor->card->text + " ";
    visitor.cards.Do({Step::kPress});
  }
  EXPECT_EQ(pages, 3);
  EXPECT_EQ(read, visitor.scene->Find("right")->label.text);
}

TEST(VisitorCards, MarksGoFromThingToThingAndStayWhileTheCameraTurns) {
  CardVisitor visitor;
  visitor.See();
  std::vector<std::string> marked;
  for (int i = 0; i < 4; ++i) {
    visitor.cards.Do({Step::kMark});
    visitor.See(i);
    marked.push_back(visitor.MarkedName());
  }
  EXPECT_THAT(marked, ElementsAre("right", "left", "middle", "right"));
  visitor.See(-40);  // Out of view.
  visitor.See();
  EXPECT_EQ(visitor.MarkedName(), "middle") << "the choice ended with the view";
}

TEST(VisitorCards, ACardStaysWhileTheCameraIsLost) {
  CardVisitor visitor;
  visitor.See();
  visitor.cards.Do({Step::kPress});
  visitor.SeeFor(5, 0, true);
  EXPECT_EQ(visitor.OpenName(), "middle");
  visitor.cards.Do({Step::kClose});
  visitor.See(0, true);
  EXPECT_EQ(visitor.OpenName(), "");
  EXPECT_THROW(visitor.cards.Do({Step::kPress}), Error) << "nothing is in view";
}

TEST(VisitorCards, WhatIsLookedAtOpensAfterAWhileAndClosesAfterOneLooksElsewhere) {
  CardVisitor visitor(true);
  visitor.SeeFor(1.2);
  EXPECT_EQ(visitor.OpenName(), "");
  EXPECT_GT(*visitor.frame.visitor->dwell, 0.7);
  visitor.SeeFor(0.5);
  EXPECT_EQ(visitor.OpenName(), "middle");
  visitor.SeeFor(60);
  EXPECT_EQ(visitor.OpenName(), "middle") << "as long as it is looked at";
  visitor.SeeFor(60, 0, true);
  EXPECT_EQ(visitor.OpenName(), "middle") << "while the camera is lost";
  visitor.SeeFor(1.8, 35);
  EXPECT_EQ(visitor.OpenName(), "middle") << "a glance aside";
  visitor.SeeFor(0.5, 35);
  EXPECT_EQ(visitor.OpenName(), "");
}

TEST(VisitorCards, GlancesOpenNothing) {
  CardVisitor visitor(true);
  for (int i = 0; i < 20; ++i) {
    visitor.SeeFor(1);
    visitor.SeeFor(0.5, 35);
    EXPECT_EQ(visitor.OpenName(), "");
  }
}

TEST(VisitorCards, PagesTurnByThemselvesForGazeAlone) {
  CardVisitor visitor(true);
  const double right_deg = std::atan2(0.6, 2) * 180 / std::numbers::pi;
  visitor.SeeFor(1.6, right_deg);
  ASSERT_EQ(visitor.OpenName(), "right");
  const std::string first = visitor.frame.visitor->card->text;
  EXPECT_THAT(visitor.frame.visitor->card->hint, ::testing::EndsWith("It turns by itself."));
  EXPECT_EQ(visitor.SeeFor(10, right_deg).card->text, first) << "300 characters take longer";
  EXPECT_NE(visitor.SeeFor(15, right_deg).card->text, first);
  visitor.SeeFor(200, right_deg);
  ASSERT_EQ(visitor.OpenName(), "right") << "the last page stays";
  EXPECT_EQ(visitor.frame.visitor->card->hint, "Look away to close.");
}

TEST(VisitorCards, SayOnceHowTheyAreOpened) {
  CardVisitor visitor;
  int said = 0;
  for (int i = 0; i < 1000; ++i) said += visitor.See().sentence.empty() ? 0 : 1;
  EXPECT_NEAR(said, 300, 5) << "ten seconds";
  CardVisitor other;
  other.See();
  other.cards.Do({Step::kPress});
  other.cards.Do({Step::kPress});
  EXPECT_EQ(other.See().sentence, "") << "who has opened one knows";
}

TEST(VisitorCards, TellWhichSoundsBelongToWhatWasOpened) {
  CardVisitor visitor;
  auto scene = std::make_shared<content::Scene>(*visitor.scene);
  scene->entities[1].group = "masks";
  content::Entity sound;
  sound.name = "drums";
  sound.group = "masks";
  sound.kind = content::Entity::Kind::kSound;
  sound.sound.position = {0, 9, 0};
  scene->entities.push_back(sound);
  visitor.scene = scene;
  visitor.See();
  visitor.cards.Do({Step::kOpen, "middle"});
  const auto opened = visitor.cards.TakeOpened();
  ASSERT_EQ(opened.size(), 1u);
  EXPECT_EQ(opened[0].entity, "middle");
  EXPECT_EQ(opened[0].map_key, 7u);
  EXPECT_THAT(opened[0].sounds, ElementsAre("drums"));
  EXPECT_TRUE(visitor.cards.TakeOpened().empty());
  EXPECT_THROW(visitor.cards.Do({Step::kOpen, "nothing"}), Error);
  EXPECT_FALSE(visitor.cards.Do({Step::kSkip}));
}

}  // namespace
}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/visitor_controls.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/script/format_command.h"

namespace docent::app {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Kind = ui::InputEvent::Kind;

// A window of 1280x800 pixels with an image of 640x400, in which a mask covers a square, and what a visitor
// does there.
class VisitorAtControls : public ::testing::Test {
 protected:
  VisitorAtControls() { Make(true, ""); }

  void Make(bool has_route, const std::string& kiosk_code) {
    VisitorControls::Host host;
    host.emit = [this](GuideVisitor guide) { given_.push_back(FormatCommand(guide)); };
    host.swap_cameras = [this] { given_.emplace_back("swap"); };
    host.toggle_full_screen = [this] { given_.emplace_back("full screen"); };
    host.toggle_fast_forward = [this] { given_.emplace_back("fast forward"); };
    host.language = "en";
    host.has_route = has_route;
    host.kiosk_code = kiosk_code;
    controls_.emplace(std::move(host));
    Show({});
  }
  // Shows a frame with this card.
  void Show(const std::optional<ui::Card>& card, bool asks = false, int visitors_before = 0) {
    auto frame = std::make_shared<ShownFrame>();
    frame->visitor.emplace();
    frame->visitor->targets = {{"mask", {100, 100}, {140, 140}}};
    frame->visitor->marked = 0;
    frame->visitor->card = card;
    frame->visitor->asks_to_continue = asks;
    frame->visitors_before = visitors_before;
    VisitorControls::Seen seen;
    seen.frame = frame;
    seen.targets = frame->visitor->targets;
    seen.width_px = 1280;
    seen.height_px = 800;
    seen.box = ui::FitImage(640, 400, 1280, 800);
    seen.style = {1.5, 0, 36};
    frame_ = frame;
    controls_->SetView(seen);
  }
  void Key(const std::string& key, Kind kind = Kind::kKey, bool control = false) {
    ui::InputEvent event;
    event.kind = kind;
    event.key = key;
    event.control = control;
    controls_->Handle(event, now_);
  }
  // Holds the space bar for this time.
  void Hold(std::chrono::milliseconds time) {
    Key("space");
    for (auto passed = std::chrono::milliseconds(0); passed < time; passed += std::chrono::milliseconds(50)) {
      now_ += std::chrono::milliseconds(50);
      controls_->Update({0, 0}, now_);
    }
    Key("space", Kind::kKeyUp);
  }
  void Touch(double x, double y, Kind kind = Kind::kClick) {
    ui::InputEvent event;
    event.kind = kind;
    event.position = {x, y};
    controls_->Handle(event, now_);
  }
  ui::Overlay Drawn() const {
    ui::View view;
    view.overlay.visitor = frame_->visitor;
    controls_->AddTo(&view);
    return view.overlay;
  }
  std::vector<std::string> Given() { return std::exchange(given_, {}); }

  std::optional<VisitorControls> controls_;
  std::shared_ptr<const ShownFrame> frame_;
  std::vector<std::string> given_;
  VisitorControls::Clock::time_point now_{};
};

TEST_F(VisitorAtControls, OneButtonOpensCardsAndGoesThroughTheMenu) {
  Hold(std::chrono::milliseconds(100));
  EXPECT_THAT(Given(), ElementsAre("tour press"));
  Hold(std::chrono::seconds(1));
  EXPECT_THAT(Given(), IsEmpty());
  ASSERT_EQ(Drawn().visitor->menu.size(), 5u);
  EXPECT_EQ(Drawn().visitor->chosen, 0u);
  Hold(std::chrono::seconds(1));
  EXPECT_THAT(Given(), ElementsAre("tour skip"));
  EXPECT_TRUE(Drawn().visitor->menu.empty());
  Hold(std::chrono::seconds(1));
  Hold(std::chrono::milliseconds(100));
  EXPECT_EQ(Drawn().visitor->chosen, 1u);
  Hold(std::chrono::seconds(1));
  EXPECT_THAT(Given(), ElementsAre("tour back"));
  // Once around: the menu is left by its last choice.
  Hold(std::chrono::seconds(1));
  for (int i = 0; i < 4; ++i) Hold(std::chrono::milliseconds(100));
  EXPECT_EQ(Drawn().visitor->chosen, 4u);
  Hold(std::chrono::seconds(1));
  EXPECT_THAT(Given(), IsEmpty());
  EXPECT_TRUE(Drawn().visitor->menu.empty());
}

TEST_F(VisitorAtControls, TheKeyboardAloneReachesEverything) {
  Key("right");
  Key("enter");
  Key("n");
  Key("b");
  EXPECT_THAT(Given(), ElementsAre("tour mark", "tour press", "tour skip", "tour back"));
  Key("l");
  EXPECT_TRUE(Drawn().visitor->lists_route);
  Key("m");
  Key("down");
  Key("enter");
  EXPECT_THAT(Given(), ElementsAre("tour back"));
  ui::Card card;
  card.entity = "mask";
  card.shown = std::make_shared<content::Entity>();
  Show(card);
  EXPECT_FALSE(Drawn().visitor->card->turned_rad) << "it turns by itself";
  Key("right");
  Key("right");
  Key("down");
  ASSERT_TRUE(Drawn().visitor->card->turned_rad);
  EXPECT_GT(Drawn().visitor->card->turned_rad->x(), 0.3);
  EXPECT_GT(Drawn().visitor->card->turned_rad->y(), 0.1);
  Key("escape");
  EXPECT_THAT(Given(), ElementsAre("tour close"));
  Key("escape");
  EXPECT_FALSE(controls_->closing());
  Key("q", Kind::kKey, true);
  EXPECT_TRUE(controls_->closing());
}

TEST_F(VisitorAtControls, ATouchOpensWhatItHitsWithinAFingertip) {
  Touch(240, 240);  // The middle of the mask.
  Touch(240, 296);  // 15 pixels of the window below it.
  Touch(240, 330);
  Touch(900, 600);
  EXPECT_THAT(Given(), ElementsAre("tour open \"mask\"", "tour open \"mask\""));
}

TEST_F(VisitorAtControls, ATouchReachesTheMenuAndItsChoices) {
  const ui::MenuLayout closed = ui::LayOutMenu(*Drawn().visitor, 1280, 800, {1.5, 0, 36});
  Touch(closed.button.x + 5, closed.button.y + 5);
  const ui::MenuLayout open = ui::LayOutMenu(*Drawn().visitor, 1280, 800, {1.5, 0, 36});
  ASSERT_EQ(open.choices.size(), 5u);
  Touch(open.choices[1].x + 9, open.choices[1].y + 9);
  EXPECT_THAT(Given(), ElementsAre("tour back"));
  Touch(closed.button.x + 5, closed.button.y + 5);
  Touch(3, 3);
  EXPECT_TRUE(Drawn().visitor->menu.empty()) << "a touch beside it closes it";
  EXPECT_THAT(Given(), IsEmpty());
  Make(false, "");
  EXPECT_FALSE(Drawn().visitor->has_menu_button) << "there are no stops";
}

TEST_F(VisitorAtControls, ACardIsTurnedByAFingerAndClosedByItsButton) {
  ui::Card card;
  card.entity = "mask";
  card.text = "A mask.";
  card.shown = std::make_shared<content::Entity>();
  Show(card);
  const ui::CardLayout layout = ui::LayOutCard(Drawn(), 1280, 800, {1.5, 0, 36});
  const Eigen::Vector2d begin(layout.shown.x + 20, layout.shown.y + 200);
  Touch(begin.x(), begin.y());
  controls_->Update(begin + Eigen::Vector2d(200, 0), now_);
  // A quarter of the smaller side is an eighth of a full turn.
  ASSERT_TRUE(Drawn().visitor->card->turned_rad);
  EXPECT_NEAR(Drawn().visitor->card->turned_rad->x(), std::numbers::pi / 4, 1e-9);
  Touch(begin.x() + 200, begin.y(), Kind::kRelease);
  controls_->Update(begin, now_);
  EXPECT_NEAR(Drawn().visitor->card->turned_rad->x(), std::numbers::pi / 4, 1e-9) << "the finger is gone";
  EXPECT_THAT(Given(), IsEmpty());
  Touch(layout.text.x + 5, layout.text.y + 5);
  Touch(layout.close.x + 5, layout.close.y + 5);
  EXPECT_THAT(Given(), ElementsAre("tour press", "tour close"));
  Show({});
  Show(card);
  EXPECT_FALSE(Drawn().visitor->card->turned_rad) << "opened anew, it turns by itself";
}

TEST_F(VisitorAtControls, ATourBeginsAnewAfterASecondChoice) {
  Hold(std::chrono::seconds(1));
  for (int i = 0; i < 3; ++i) Hold(std::chrono::milliseconds(100));
  Hold(std::chrono::seconds(1));
  ASSERT_EQ(Drawn().visitor->menu.size(), 2u);
  EXPECT_EQ(Drawn().visitor->chosen, 0u) << "the tour goes on unless something else is chosen";
  Hold(std::chrono::seconds(1));
  EXPECT_THAT(Given(), IsEmpty());
  EXPECT_TRUE(Drawn().visitor->menu.empty());
  Key("l");
  Key("r");
  Key("down");
  Key("enter");
  EXPECT_THAT(Given(), ElementsAre("tour restart"));
  EXPECT_TRUE(Drawn().visitor->menu.empty());
  EXPECT_TRUE(Drawn().visitor->lists_route);
  Show({}, false, 1);
  EXPECT_FALSE(Drawn().visitor->lists_route) << "the next visitor has not asked for it";
}

TEST_F(VisitorAtControls, WhoTakesADeviceThatWasLeftIsAskedOnce) {
  Key("m");
  Show({}, true);
  ASSERT_EQ(Drawn().visitor->menu.size(), 2u);
  Touch(3, 3);
  for (const char* key : {"m", "n", "b", "l"}) Key(key);
  EXPECT_EQ(Drawn().visitor->menu.size(), 2u) << "a hand that takes up the device answers nothing";
  EXPECT_FALSE(Drawn().visitor->lists_route);
  const ui::MenuLayout open = ui::LayOutMenu(*Drawn().visitor, 1280, 800, {1.5, 0, 36});
  Touch(open.choices[1].x + 9, open.choices[1].y + 9);
  EXPECT_THAT(Given(), ElementsAre("tour restart"));
  Show({}, true);
  EXPECT_TRUE(Drawn().visitor->menu.empty()) << "the answer is on its way";
  Show({});
  for (const char* key : {"enter", "escape"}) {
    Show({}, true);
    Key(key);
    EXPECT_THAT(Given(), ElementsAre("tour continue"));
    Show({});
  }
  Show({}, true);
  Show({});
  EXPECT_TRUE(Drawn().visitor->menu.empty()) << "the time for an answer is over";
}

TEST_F(VisitorAtControls, AKioskHasNoKeysOfEngineersAndEndsByItsCode) {
  Make(true, "4711");
  for (const char* key : {"c", "f", "f11", "p", "d", "escape"}) Key(key);
  Key("q", Kind::kKey, true);
  EXPECT_THAT(Given(), IsEmpty());
  EXPECT_FALSE(Drawn().points);
  EXPECT_TRUE(Drawn().visitor);
  Key("enter");
  EXPECT_THAT(Given(), ElementsAre("tour press"));
  for (const char* key : {"4", "7", "1"}) Key(key);
  EXPECT_FALSE(controls_->closing());
  Key("1");
  EXPECT_TRUE(controls_->closing());
}

}  // namespace
}  // namespace docent::app

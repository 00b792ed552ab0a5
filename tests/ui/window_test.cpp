// SPDX-License-Identifier: Apache-2.0
#include "ui/window.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <gmock/gmock.h>

#include <cstdlib>
#include <optional>

#include "tests/support/must_run.h"
#include "tests/support/person_at_window.h"
#include "tests/support/virtual_screen.h"
#include "tests/ui/asked_for.h"
#include "tests/ui/ui_testing.h"
#include "ui/authoring_panel.h"
#include "ui/entity_section.h"
#include "ui/gui.h"
#include "ui/letterbox.h"
#include "ui/message_area.h"
#include "ui/message_board.h"

namespace docent::ui {
namespace {

TEST(Window, ThrowsAClearErrorWithoutADisplay) {
  unsetenv("DISPLAY");
  unsetenv("WAYLAND_DISPLAY");
  try {
    Window window("none", 100, 100);
    FAIL() << "a window was opened without a display";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("no display"), std::string::npos) << error.what();
  }
}

TEST(KeyName, IsTheLetterThatTheLayoutWrites) {
  EXPECT_EQ(KeyName(GLFW_KEY_Z, "z"), "z");
  EXPECT_EQ(KeyName(GLFW_KEY_Y, "z"), "z") << "German";
  EXPECT_EQ(KeyName(GLFW_KEY_Q, "a"), "a") << "French";
  EXPECT_EQ(KeyName(GLFW_KEY_SEMICOLON, "m"), "m") << "French";
  EXPECT_EQ(KeyName(GLFW_KEY_M, ","), "") << "French";
  EXPECT_EQ(KeyName(GLFW_KEY_Z, "я"), "z") << "Russian";
  EXPECT_EQ(KeyName(GLFW_KEY_SEMICOLON, ";"), "");
}

TEST(KeyName, IsTheDigitInEveryLayoutAndOnTheKeypad) {
  EXPECT_EQ(KeyName(GLFW_KEY_1, "1"), "1");
  EXPECT_EQ(KeyName(GLFW_KEY_1, "&"), "1") << "French";
  EXPECT_EQ(KeyName(GLFW_KEY_2, "ě"), "2") << "Czech";
  EXPECT_EQ(KeyName(GLFW_KEY_KP_0, "0"), "0");
  EXPECT_EQ(KeyName(GLFW_KEY_KP_9, "9"), "9");
  EXPECT_EQ(KeyName(GLFW_KEY_KP_ENTER, ""), "enter");
  EXPECT_EQ(KeyName(GLFW_KEY_ENTER, ""), "enter");
  EXPECT_EQ(KeyName(GLFW_KEY_F11, ""), "f11");
}

// An author's interface on a virtual screen, with a person at it.
class InterfaceOnScreen : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!screen_.works()) SKIP_OR_FAIL("Xvfb is not installed");
    if (!HasXdotool()) SKIP_OR_FAIL("xdotool is not installed");
    window_.emplace("Docent", 800, 600);
    gui_.emplace(&*window_);
    panel_.emplace(&asked_);
    facts_.selection = &selection_;
    for (int i = 0; i < 3; ++i) Draw();
  }

  void Draw() {
    for (InputEvent& event : window_->PollEvents()) events_.push_back(std::move(event));
    const Eigen::Vector2i size = window_->WindowSize();
    layout_ = LayOutWindow(size.x(), size.y(), 1, panel_->choices().panel_open);
    gui_->Begin(layout_.scale);
    if (section_) {
      section_->DrawSelected(facts_);
    } else {
      panel_->Draw(layout_, facts_);
      DrawMessages(layout_, &board_, &asked_);
      dialog_.Draw(layout_, &asked_);
    }
    gui_->Draw();
    window_->Show();
  }

  // The field has the keyboard then.
  void BeginRenameOfHall() {
    MapFacts other, hall;
    other.name = "Attic";
    hall.name = facts_.map_name = "Hall";
    hall.is_initialized = true;
    hall.policy = "open";
    facts_.maps = {other, hall};
    panel_->BeginMapRename();
    for (int i = 0; i < 3; ++i) Draw();
    ASSERT_TRUE(gui_->WritesText());
  }
  void Click(const Eigen::Vector2d& point) { person_.Click(point); }
  void Press(const std::string& key) { person_.Press(key); }

  VirtualScreen screen_{"1024x768"};
  std::optional<Window> window_;
  std::optional<Gui> gui_;
  AskedFor asked_;
  std::optional<AuthoringPanel> panel_;
  std::optional<EntitySection> section_;  // If given, the fields of what is selected are drawn alone.
  Selection selection_;
  AuthoringFacts facts_;
  MessageBoard board_;
  QuitDialog dialog_;
  WindowLayout layout_;
  std::vector<InputEvent> events_;
  PersonAtWindow person_{[this] { Draw(); }};
};

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST_F(InterfaceOnScreen, TellsClicksInTheImageFromThoseInThePanel) {
  Click({200, 300});
  ASSERT_EQ(events_.size(), 2u);
  EXPECT_EQ(events_[0].kind, InputEvent::Kind::kClick);
  EXPECT_LT((events_[0].position - Eigen::Vector2d(200, 300)).norm(), 1);
  EXPECT_EQ(events_[1].kind, InputEvent::Kind::kRelease);
  const Eigen::Vector2d panel(layout_.panel.x + 0.5 * layout_.panel.width, 590);
  EXPECT_FALSE(gui_->WantsMouse({200, 300}));
  EXPECT_TRUE(gui_->WantsMouse(panel)) << "the pointer was not there in a frame";
  Click(panel);
  EXPECT_FALSE(gui_->WantsMouse({200, 300}));
  EXPECT_TRUE(gui_->WantsMouse(panel));
}

TEST_F(InterfaceOnScreen, EnterInTheNameStartsTheMap) {
  // The field is found by going through the panel with the keyboard: the first one that takes text.
  gui_->FocusWindow(AuthoringPanel::window_name());
  for (int i = 0; i < 10; ++i) Draw();
  EXPECT_TRUE(gui_->IsNavigated());
  for (int i = 0; i < 8 && !gui_->WritesText(); ++i) Press("Tab");
  ASSERT_TRUE(gui_->WritesText());
  person_.Type("Hall");
  EXPECT_EQ(panel_->choices().map_name, "Hall");
  Press("Return");
  EXPECT_THAT(asked_.words, ElementsAre("new map Hall"));
  EXPECT_TRUE(panel_->choices().map_name.empty());
}

TEST_F(InterfaceOnScreen, AMessageIsDismissedByItsButton) {
  board_.AddError("There is no surface at this pixel.");
  Draw();
  // The button is at the right end of the message, above the image's lower edge.
  const double right = 0.5 * layout_.image.width + std::min(280.0, 0.5 * layout_.image.width - 12);
  Click({right - 35, layout_.image.bottom() - 12 - 14});
  EXPECT_THAT(board_.messages(), IsEmpty());
  EXPECT_THAT(asked_.words, IsEmpty());
}

TEST_F(InterfaceOnScreen, WhatWasDoneIsUndoneByItsButton) {
  board_.AddDone("Placed fox.", true, 0);
  Draw();
  const double right = 0.5 * layout_.image.width + std::min(280.0, 0.5 * layout_.image.width - 12);
  Click({right - 25, layout_.image.bottom() - 12 - 14});
  EXPECT_THAT(asked_.words, ElementsAre("undo"));
}

TEST_F(InterfaceOnScreen, EscapeClosesTheQuestionAndQuitsNothing) {
  dialog_.Open();
  Draw();
  Draw();
  EXPECT_TRUE(dialog_.is_open());
  EXPECT_TRUE(gui_->HasPopup());
  Press("Escape");
  EXPECT_FALSE(dialog_.is_open());
  EXPECT_FALSE(window_->IsClosing());
  EXPECT_THAT(asked_.words, IsEmpty());
  dialog_.Open();
  Draw();
  Draw();
  Press("Return");  // The first answer has the focus.
  EXPECT_THAT(asked_.words, ElementsAre("save and quit"));
}

TEST_F(InterfaceOnScreen, KeysBetweenTwoFramesCountInTheirOrder) {
  dialog_.Open();
  for (int i = 0; i < 3; ++i) Draw();
  person_.PressBetweenFrames("Right Return");
  for (int i = 0; i < 6; ++i) Draw();
  EXPECT_THAT(asked_.words, ElementsAre("quit without saving"));
  person_.PressBetweenFrames("Left Right Right Escape");
  for (int i = 0; i < 12; ++i) Draw();
  EXPECT_FALSE(dialog_.is_open());
  EXPECT_THAT(asked_.words, ElementsAre("quit without saving"));
}

TEST_F(InterfaceOnScreen, ControlKeysBetweenTwoFramesChangeTheText) {
  BeginRenameOfHall();
  person_.PressBetweenFrames("End ctrl+a ctrl+c End ctrl+v Return");
  for (int i = 0; i < 16; ++i) Draw();
  EXPECT_THAT(asked_.words, ElementsAre("rename map Hall to HallHall"));
}

TEST_F(InterfaceOnScreen, TextBetweenTwoFramesIsWrittenInItsOrderWithKeys) {
  BeginRenameOfHall();
  person_.PressBetweenFrames("End a BackSpace b ctrl+a C o v e space 2 BackSpace 3 Return");
  for (int i = 0; i < 24; ++i) Draw();
  EXPECT_THAT(asked_.words, ElementsAre("rename map Hall to Cove 3"));
}

TEST_F(InterfaceOnScreen, UndoAndRedoAreTheLettersOfTheLayout) {
  gui_.reset();
  window_.reset();
  if (std::system("setxkbmap de") != 0) GTEST_SKIP() << "setxkbmap does not work";
  window_.emplace("Docent", 800, 600);
  gui_.emplace(&*window_);
  BeginRenameOfHall();
  Press("End");
  Press("BackSpace");
  Press("ctrl+z");
  Press("ctrl+y");
  Press("Return");
  EXPECT_THAT(asked_.words, ElementsAre("rename map Hall to Hal"));
}

TEST_F(InterfaceOnScreen, AFieldIsLeftOnceItHasTheKeysThatWerePressedBefore) {
  BeginRenameOfHall();
  Press("End");
  person_.PressBetweenFrames("BackSpace BackSpace");
  gui_->LeaveField();
  for (int i = 0; i < 8; ++i) Draw();
  EXPECT_FALSE(gui_->IsLeavingField());
  EXPECT_THAT(asked_.words, ElementsAre("rename map Hall to Ha"));
}

TEST_F(InterfaceOnScreen, AFullScreenStaysWhenAnotherWindowGetsTheKeyboard) {
  EXPECT_EQ(glfwGetWindowAttrib(window_->handle(), GLFW_AUTO_ICONIFY), GLFW_FALSE);
}

TEST_F(InterfaceOnScreen, ThePanelOpensAndCloses) {
  const double open = layout_.panel.width;
  Click({layout_.panel.x + 20, 20});
  EXPECT_FALSE(panel_->choices().panel_open);
  EXPECT_LT(layout_.panel.width, 0.2 * open);
  Click({layout_.panel.x + 14, 20});
  EXPECT_TRUE(panel_->choices().panel_open);
}

TEST_F(InterfaceOnScreen, AClickInTheListSelectsTheEntity) {
  content::Scene scene;
  scene.entities.resize(2);
  scene.entities[0].name = "sign-1";
  scene.entities[1].name = "sign-2";
  facts_.scene = &scene;
  facts_.map_name = "Hall";
  Draw();
  // The rows are below the header of the list: clicks from top to bottom meet both in order.
  for (double y = 350; y < 660 && asked_.words.size() < 1; y += 14) Click({layout_.panel.x + 40, y});
  EXPECT_THAT(asked_.words, ElementsAre("select sign-1"));
}

TEST_F(InterfaceOnScreen, ASignpostPointsAheadByItsButtonWhileThereIsAPose) {
  content::Scene scene;
  scene.entities.resize(1);
  scene.entities[0].name = "sign-1";
  facts_.scene = &scene;
  facts_.has_pose = true;
  selection_.Set({"sign-1"});
  section_.emplace(&asked_);
  Draw();
  // Without a window of its own it is drawn in ImGui's own one, at (60, 60); the fields above the button ask
  // for nothing when they are clicked.
  double y = 90;
  for (; y < 440 && asked_.words.empty(); y += 11) Click({110, y});
  EXPECT_THAT(asked_.words, ElementsAre("point ahead sign-1"));
  asked_.words.clear();
  facts_.has_pose = false;
  Click({110, y - 11});
  EXPECT_THAT(asked_.words, IsEmpty());
}

TEST_F(InterfaceOnScreen, TheCurrentMapIsRenamedInItsField) {
  BeginRenameOfHall();
  Press("ctrl+a");
  person_.Type("Cove");
  Press("Return");
  EXPECT_THAT(asked_.words, ElementsAre("rename map Hall to Cove"));
}

TEST(Letterbox, MapsWindowPointsToImagePixels) {
  const Letterbox box = FitImage(640, 480, 1280, 1000);
  EXPECT_EQ(box.width, 1280);
  EXPECT_EQ(box.height, 960);
  EXPECT_EQ(box.y, 20);
  EXPECT_LT((box.ImageFromWindow({1, 21}) - Eigen::Vector2d(0, 0)).norm(), 1e-12);
  EXPECT_LT((box.ImageFromWindow({1279, 979}) - Eigen::Vector2d(639, 479)).norm(), 1e-12);
}

}  // namespace
}  // namespace docent::ui

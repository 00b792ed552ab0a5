// SPDX-License-Identifier: Apache-2.0
// The author's controls on a virtual screen, with frames that the test makes.
#include "app/command_line/author_controls.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "tests/app/support/temporary_folder.h"
#include "tests/support/must_run.h"
#include "tests/support/person_at_window.h"
#include "tests/support/virtual_screen.h"

namespace docent::app {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// An author whose camera is in a map with a signpost, and who writes its name.
class AuthorAtControls : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!screen_.works()) SKIP_OR_FAIL("Xvfb is not installed");
    if (!HasXdotool()) SKIP_OR_FAIL("xdotool is not installed");
    setenv("XDG_STATE_HOME", folder_.path().c_str(), 1);
    content::Scene scene;
    scene.entities.resize(1);
    scene.entities[0].name = "sign-1";
    scene_ = std::make_shared<const content::Scene>(std::move(scene));
    window_.emplace("Docent", 1280, 1000);
    AuthorControls::Host host;
    host.emit = [this](Command command) { commands_.push_back(std::move(command)); };
    host.scene_of = [this](std::uint64_t) { return scene_; };
    controls_.emplace(&*window_, std::move(host), folder_.path());
    Draw(5);
  }
  void TearDown() override { unsetenv("XDG_STATE_HOME"); }

  void Draw(int frames) {
    for (int i = 0; i < frames; ++i) {
      for (const ui::InputEvent& event : window_->PollEvents()) controls_->Handle(event);
      const Eigen::Vector2i size = window_->WindowSize();
      const ui::WindowLayout layout =
          ui::LayOutWindow(size.x(), size.y(), 1, controls_->choices().panel_open);
      controls_->SetView(Seen(layout), saving_, {});
      controls_->Update();
      controls_->Draw(layout);
      window_->Show();
    }
  }
  AuthorView Seen(const ui::WindowLayout& layout) {
    AuthorView view;
    view.image = layout.image;
    view.box = ui::FitImage(640, 480, layout.image);
    view.camera.lens = lens_;
    if (controls_->choices().frozen && shown_) {
      view.frame = shown_;
      view.scene = scene_;
      return view;
    }
    auto frame = std::make_shared<ShownFrame>();
    frame->tracked.state = engine::TrackingState::kLost;
    if (is_in_map_) {
      frame->tracked.map_key = map_key_;
      frame->shown.map_name = "Hall";
      view.scene = frame->shown.scene = scene_;
    }
    view.frame = shown_ = std::move(frame);
    return view;
  }
  void SetLens() {
    lens_ = engine::CameraModel(engine::LensModel::kRadialTangential, {640, 480, 500, 500, 320, 240}, {});
  }
  // The Undo button of the only message, at its right end.
  Eigen::Vector2d UndoButton() const {
    const Eigen::Vector2i size = window_->WindowSize();
    const ui::Area image = ui::LayOutWindow(size.x(), size.y(), 1, controls_->choices().panel_open).image;
    const double right = 0.5 * image.width + std::min(280.0, 0.5 * image.width - 12);
    return {right - 25, image.bottom() - 12 - 14};
  }
  void ClickUndo() { person_.Click(UndoButton()); }
  // While no frame is drawn.
  static void MovePointer(const Eigen::Vector2d& point) {
    const std::string move = "xdotool mousemove " + std::to_string(std::lround(point.x())) + " " +
                             std::to_string(std::lround(point.y()));
    ASSERT_EQ(std::system(move.c_str()), 0);
  }
  // The key as the window reports it, without a frame.
  void HandleEnter() {
    ui::InputEvent enter;
    enter.key = "enter";
    controls_->Handle(enter);
  }
  // The pointer was there in the last frame.
  void ShowMessageWithPointerAt(const Eigen::Vector2d& point) {
    SetLens();
    controls_->Take({Notice{"", RenameEntity{"sign-1", "Cove"}}});
    MovePointer(point);
    Draw(5);
    controls_->choices().pick = ui::MapPick::kFloor;
  }
  void ClickPixel(const Eigen::Vector2d& pixel) {
    const Eigen::Vector2i size = window_->WindowSize();
    const ui::WindowLayout layout = ui::LayOutWindow(size.x(), size.y(), 1, controls_->choices().panel_open);
    ui::InputEvent click;
    click.kind = ui::InputEvent::Kind::kClick;
    click.position = ui::FitImage(640, 480, layout.image).WindowFromImage(pixel);
    controls_->Handle(click);
  }

  void BeginName() {
    controls_->Select("sign-1", false);
    ui::InputEvent rename;
    rename.key = "f2";
    controls_->Handle(rename);
    Draw(5);
  }
  void WriteName() {
    BeginName();
    person_.Press("ctrl+a");
    person_.Type("Cove");
  }
  void PressReturn() { person_.Press("Return"); }
  // With unsaved changes, all keys come between two frames, and the question stays until it is answered.
  void ExpectQuestionAfter(const std::string& keys) {
    saving_.unsaved = true;
    Draw(3);
    person_.PressBetweenFrames(keys);
    Draw(12);
    EXPECT_EQ(controls_->ending(), AuthorControls::Ending::kNone);
    PressReturn();
    EXPECT_EQ(controls_->ending(), AuthorControls::Ending::kSave);
  }
  void LoseTheCamera() {
    is_in_map_ = false;
    Draw(3);
    is_in_map_ = true;
    Draw(3);
  }

  const TemporaryFolder folder_;
  VirtualScreen screen_{"1280x1024"};
  std::shared_ptr<const content::Scene> scene_;
  std::vector<Command> commands_;
  std::optional<ui::Window> window_;
  std::optional<AuthorControls> controls_;
  SavingState saving_;
  std::shared_ptr<const ShownFrame> shown_;
  engine::CameraModel lens_;  // Until it is set, no point of the window is in the image.
  bool is_in_map_ = true;
  std::uint64_t map_key_ = 7;
  PersonAtWindow person_{[this] { Draw(1); }};
};

TEST_F(AuthorAtControls, WhatIsBeingWrittenIsNotLostWithTheCamera) {
  WriteName();
  LoseTheCamera();
  EXPECT_THAT(commands_, IsEmpty());
  PressReturn();
  EXPECT_THAT(commands_, ElementsAre(Command(RenameEntity{"sign-1", "Cove"})));
}

TEST_F(AuthorAtControls, WhatIsWrittenIsACommandAlsoWhileTheCameraIsLost) {
  WriteName();
  is_in_map_ = false;
  Draw(3);
  PressReturn();
  EXPECT_THAT(commands_, ElementsAre(Command(RenameEntity{"sign-1", "Cove"})));
}

TEST_F(AuthorAtControls, NothingIsWrittenToTheMapThatTheAuthorGoesTo) {
  WriteName();
  controls_->Take({Notice{"", UseMap{"Room"}}});
  Draw(3);
  is_in_map_ = false;
  Draw(3);
  PressReturn();
  EXPECT_THAT(commands_, IsEmpty());
}

TEST_F(AuthorAtControls, WhatIsBeingWrittenIsNotLostBecauseAnotherMapWasRemoved) {
  controls_->Take({Notice{"", RemoveMap{"Room"}}});
  Draw(3);
  WriteName();
  LoseTheCamera();
  PressReturn();
  EXPECT_THAT(commands_, ElementsAre(Command(RenameEntity{"sign-1", "Cove"})));
}

TEST_F(AuthorAtControls, WhatIsBeingWrittenIsNotLostByContinuingItsMap) {
  WriteName();
  is_in_map_ = false;
  Draw(3);
  controls_->Take({Notice{"", UseMap{"Hall"}}});
  Draw(3);
  is_in_map_ = true;
  Draw(3);
  PressReturn();
  EXPECT_THAT(commands_, ElementsAre(Command(RenameEntity{"sign-1", "Cove"})));
}

TEST_F(AuthorAtControls, NothingIsWrittenToAMapThatWasRenamedAndRemovedWhileTheCameraWasLost) {
  WriteName();
  is_in_map_ = false;
  Draw(3);
  controls_->Take({Notice{"", RenameMap{"Hall", "Lobby"}}, Notice{"", RemoveMap{"Lobby"}}});
  Draw(3);
  PressReturn();
  EXPECT_THAT(commands_, IsEmpty());
}

TEST_F(AuthorAtControls, NothingIsWrittenToAMapThatWasRenamedAndRemovedWhileTheViewWasFrozen) {
  WriteName();
  controls_->Take({Notice{"", RenameMap{"Hall", "Lobby"}}});
  Draw(3);  // The frozen frame has the name that the map had.
  controls_->Take({Notice{"", RemoveMap{"Lobby"}}});
  is_in_map_ = false;
  Draw(3);
  PressReturn();
  EXPECT_THAT(commands_, IsEmpty());
}

TEST_F(AuthorAtControls, ChangesWhileTheCameraIsLostAreKnownToTheNextOne) {
  is_in_map_ = false;
  Draw(1);
  content::Scene scene = *scene_;
  scene.entities[0].group = "group-1";
  scene_ = std::make_shared<const content::Scene>(std::move(scene));
  Draw(1);
  controls_->Group({"sign-2"});
  EXPECT_THAT(commands_, ElementsAre(Command(GroupEntities{{"sign-2"}, "group-2"})));
}

TEST_F(AuthorAtControls, WhatIsCopiedWhileTheCameraIsLostIsPasted) {
  controls_->Select("sign-1", false);
  Draw(1);
  is_in_map_ = false;
  Draw(1);
  controls_->CopySelected();
  is_in_map_ = true;
  Draw(1);
  controls_->Paste();
  EXPECT_THAT(commands_, ElementsAre(Command(PasteEntities{{"sign-1"}, "Hall", std::nullopt})));
}

TEST_F(AuthorAtControls, WhatWasCopiedIsPastedUnderItsNewNames) {
  controls_->Select("sign-1", false);
  Draw(1);
  controls_->CopySelected();
  controls_->Take({Notice{"", RenameEntity{"sign-1", "Cove"}}, Notice{"", RenameMap{"Hall", "Lobby"}}});
  controls_->Paste();
  EXPECT_THAT(commands_, ElementsAre(Command(PasteEntities{{"Cove"}, "Lobby", std::nullopt})));
}

TEST_F(AuthorAtControls, TheMapThatSignpostsAreToLeadToIsKnownByItsNewNameUntilItIsRemoved) {
  controls_->choices().sign_to_map = "Hall";
  controls_->Take({Notice{"", RenameMap{"Hall", "Lobby"}}, Notice{"", RemoveMap{"Room"}}});
  EXPECT_EQ(controls_->choices().sign_to_map, "Lobby");
  controls_->Take({Notice{"", RemoveMap{"Lobby"}}});
  EXPECT_EQ(controls_->choices().sign_to_map, "");
}

TEST_F(AuthorAtControls, WhatIsBeingWrittenIsACommandBeforeThePanelCloses) {
  WriteName();
  // Both keys come in one frame, as from a slow machine.
  ASSERT_EQ(std::system("xdotool key d sleep 0.1 key F9 sleep 0.1"), 0);
  Draw(5);
  EXPECT_THAT(commands_, ElementsAre(Command(RenameEntity{"sign-1", "Coved"})));
  EXPECT_FALSE(controls_->choices().panel_open);
}

TEST_F(AuthorAtControls, WhatIsBeingWrittenIsAChangeThatQuittingAsksAbout) {
  WriteName();
  person_.Press("ctrl+q");
  EXPECT_THAT(commands_, ElementsAre(Command(RenameEntity{"sign-1", "Cove"})));
  EXPECT_EQ(controls_->ending(), AuthorControls::Ending::kNone);
  PressReturn();
  EXPECT_EQ(controls_->ending(), AuthorControls::Ending::kSave) << "the answer that is chosen at first";
}

TEST_F(AuthorAtControls, WhatIsBeingWrittenIsNotLostToTheQuestionWhetherToSave) {
  saving_.unsaved = true;
  WriteName();
  ui::InputEvent close;
  close.kind = ui::InputEvent::Kind::kClose;
  controls_->Handle(close);
  Draw(5);
  EXPECT_THAT(commands_, ElementsAre(Command(RenameEntity{"sign-1", "Cove"})));
  EXPECT_EQ(controls_->ending(), AuthorControls::Ending::kNone);
}

TEST_F(AuthorAtControls, QuittingAsksNothingWhereNothingWasWritten) {
  BeginName();
  person_.Press("ctrl+q");
  EXPECT_THAT(commands_, IsEmpty());
  EXPECT_EQ(controls_->ending(), AuthorControls::Ending::kSave);
}

TEST_F(AuthorAtControls, NothingIsPlacedOnceTheAuthorHasAskedToQuit) {
  SetLens();
  ASSERT_EQ(std::system("xdotool mousemove 300 400"), 0);
  Draw(3);
  ui::InputEvent quit, enter;
  quit.key = "q";
  quit.control = true;
  enter.key = "enter";
  const auto press_enter = [&] {
    controls_->choices().pick = ui::MapPick::kFloor;
    controls_->Handle(enter);
  };
  press_enter();
  EXPECT_EQ(commands_.size(), 1u);
  saving_.unsaved = true;
  Draw(1);
  // Both keys come in one frame.
  controls_->Handle(quit);
  press_enter();
  EXPECT_EQ(commands_.size(), 1u);
  EXPECT_EQ(controls_->ending(), AuthorControls::Ending::kNone);
}

TEST_F(AuthorAtControls, EnterBeforeTheWishToQuitDoesNotAnswerItsQuestion) {
  ExpectQuestionAfter("Down Return ctrl+q");
}

TEST_F(AuthorAtControls, EscapeBeforeTheWishToQuitDoesNotCloseItsQuestion) {
  ExpectQuestionAfter("Escape ctrl+q");
}

TEST_F(AuthorAtControls, NothingIsPlacedOnceTheAuthorHasQuit) {
  SetLens();
  ASSERT_EQ(std::system("xdotool mousemove 300 400"), 0);
  Draw(3);
  ui::InputEvent quit, enter;
  quit.key = "q";
  quit.control = true;
  enter.key = "enter";
  controls_->choices().pick = ui::MapPick::kFloor;
  controls_->Handle(quit);
  Draw(3);
  EXPECT_EQ(controls_->ending(), AuthorControls::Ending::kSave) << "nothing was unsaved";
  controls_->Handle(enter);
  EXPECT_THAT(commands_, IsEmpty());
}

TEST_F(AuthorAtControls, ALengthIsMeasuredInOneImage) {
  SetLens();
  controls_->choices().pick = ui::MapPick::kMeasureFrom;
  Draw(2);
  ClickPixel({200, 240});
  EXPECT_TRUE(controls_->choices().frozen);
  Draw(2);
  EXPECT_EQ(controls_->choices().pick, ui::MapPick::kMeasureTo);
  ClickPixel({400, 240});
  ASSERT_EQ(commands_.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<SetMapScale>(commands_[0]));
  EXPECT_FALSE(controls_->choices().frozen);
}

TEST_F(AuthorAtControls, MeasuringEndsWhenAnotherImageIsShownBetweenBothClicks) {
  SetLens();
  controls_->choices().pick = ui::MapPick::kMeasureFrom;
  Draw(2);
  ClickPixel({200, 240});
  Draw(2);
  controls_->choices().frozen = false;
  Draw(2);
  EXPECT_EQ(controls_->choices().pick, ui::MapPick::kNone);
  ClickPixel({400, 240});
  EXPECT_THAT(commands_, IsEmpty());
}

TEST_F(AuthorAtControls, NothingIsPlacedAtAPixelThatTheMapFromAboveHides) {
  SetLens();
  controls_->Select("sign-1", false);
  Draw(1);
  controls_->CopySelected();
  ui::InputEvent drop;
  drop.kind = ui::InputEvent::Kind::kDrop;
  drop.position = {300, 400};
  drop.files = {"fox.glb"};
  controls_->choices().from_above = true;
  Draw(1);
  controls_->Handle(drop);
  EXPECT_THAT(commands_, IsEmpty());
  controls_->Paste();
  EXPECT_THAT(commands_, ElementsAre(Command(PasteEntities{{"sign-1"}, "Hall", std::nullopt})));
  controls_->choices().from_above = false;
  Draw(1);
  controls_->Handle(drop);
  EXPECT_EQ(commands_.size(), 2u);
}

TEST_F(AuthorAtControls, ADroppedSoundHasACaptionThatTheAuthorSeesOrItsName) {
  SetLens();
  Draw(1);
  controls_->choices().caption = "The lion roars";
  const auto captions = [&](std::vector<std::string> files) {
    ui::InputEvent drop;
    drop.kind = ui::InputEvent::Kind::kDrop;
    drop.position = {300, 400};
    drop.files = std::move(files);
    commands_.clear();
    controls_->Handle(drop);
    std::vector<std::string> found;
    for (const Command& command : commands_) {
      const auto* const sound = std::get_if<PlaceSound>(&command);
      found.push_back(sound == nullptr ? "no sound" : sound->caption);
    }
    return found;
  };
  EXPECT_THAT(captions({"bird.wav"}), ElementsAre("bird")) << "the caption was of an earlier sound";
  controls_->choices().tool = ui::AuthoringTool::kSound;
  EXPECT_THAT(captions({"lion.wav"}), ElementsAre("The lion roars"));
  EXPECT_THAT(captions({"lion.wav", "fox.glb"}), ElementsAre("The lion roars", "no sound"));
  EXPECT_THAT(captions({"bird.wav", "lion.wav"}), ElementsAre("bird", "lion"));
}

TEST_F(AuthorAtControls, WhatWasDoneIsUndoneByTheButtonOfItsMessage) {
  controls_->Take({Notice{"", RenameEntity{"sign-1", "Cove"}}});
  Draw(3);
  ClickUndo();
  EXPECT_THAT(commands_, ElementsAre(Command(Undo{})));
}

TEST_F(AuthorAtControls, EnterPressesTheButtonUnderThePointerAndPlacesNothingBehindIt) {
  ShowMessageWithPointerAt(UndoButton());
  PressReturn();
  EXPECT_THAT(commands_, ElementsAre(Command(Undo{})));
}

TEST_F(AuthorAtControls, EnterPressesTheButtonThatThePointerHasReachedSinceTheLastFrame) {
  ShowMessageWithPointerAt({300, 400});
  MovePointer(UndoButton());
  HandleEnter();
  Draw(5);
  EXPECT_THAT(commands_, ElementsAre(Command(Undo{})));
}

TEST_F(AuthorAtControls, EnterClicksInTheImageThatThePointerHasReachedSinceTheLastFrame) {
  ShowMessageWithPointerAt(UndoButton());
  MovePointer({300, 400});
  HandleEnter();
  Draw(5);
  ASSERT_EQ(commands_.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<SetMapUp>(commands_[0]));
}

TEST_F(AuthorAtControls, EnterPressesTheButtonAlthoughThePointerMovesOnBeforeTheNextFrame) {
  ShowMessageWithPointerAt(UndoButton());
  HandleEnter();
  MovePointer({300, 400});
  Draw(5);
  EXPECT_THAT(commands_, ElementsAre(Command(Undo{})));
}

TEST_F(AuthorAtControls, AClickInTheImageCountsAlthoughThePointerWasOverAButtonInTheLastFrame) {
  ShowMessageWithPointerAt(UndoButton());
  ClickPixel({200, 240});
  ASSERT_EQ(commands_.size(), 1u);
  EXPECT_TRUE(std::holds_alternative<SetMapUp>(commands_[0]));
}

TEST_F(AuthorAtControls, TheButtonOfAMessageUndoesNothingOfAnotherMap) {
  controls_->Take({Notice{"", RenameEntity{"sign-1", "Cove"}}});
  Draw(3);
  map_key_ = 8;
  Draw(3);
  ClickUndo();
  EXPECT_THAT(commands_, IsEmpty());
}

}  // namespace
}  // namespace docent::app

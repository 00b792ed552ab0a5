// SPDX-License-Identifier: Apache-2.0
// To which entity the fields of the panel write.
#include "ui/entity_section.h"

#include <gmock/gmock.h>

#include "tests/ui/panel_without_screen.h"

namespace docent::ui {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

// Two signposts, of which the first is selected.
class FieldsOfEntities : public PanelWithoutScreen {
 protected:
  FieldsOfEntities() {
    scene_.entities.resize(2);
    scene_.entities[0].name = "sign-1";
    scene_.entities[0].signpost.text = "Elephants";
    scene_.entities[1].name = "sign-2";
    scene_.entities[1].signpost.text = "Giraffes";
    facts_.scene = &scene_;
    facts_.map_key = 1;
    facts_.selection = &selection_;
    selection_.Set({"sign-1"});
    for (int i = 0; i < 3; ++i) Draw();
  }
  void DrawPart() override {
    if (is_panel_open_) section_.DrawSelected(facts_);
  }

  // The first fields are below each other; a click at the right end puts the cursor behind the text.
  static float FirstLine() { return ImGui::GetStyle().WindowPadding.y + 0.5f * ImGui::GetFrameHeight(); }
  void ClickName() { Click(kWidth - 40, FirstLine()); }
  void ClickText() { Click(kWidth - 40, FirstLine() + ImGui::GetFrameHeightWithSpacing()); }
  void ClickLanguage() {
    const ImGuiStyle& style = ImGui::GetStyle();
    const float text = FirstLine() + ImGui::GetFrameHeightWithSpacing() - 0.5f * ImGui::GetFrameHeight();
    Click(kWidth - 40,
          text + 3.5f * ImGui::GetTextLineHeight() + style.ItemSpacing.y + 0.5f * ImGui::GetFrameHeight());
  }
  // A click in the image, which changes the selection before the panel is drawn.
  void ClickImageAndSelect(std::vector<std::string> names) {
    MoveToImage();
    selection_.Set(std::move(names));
    PressAndRelease();
  }

  content::Scene scene_;
  Selection selection_;
  EntitySection section_{&asked_};
  bool is_panel_open_ = true;
};

TEST_F(FieldsOfEntities, WhatIsBeingWrittenBelongsToTheEntityThatWasSelected) {
  ClickText();
  ASSERT_TRUE(WritesText());
  Type("!");
  EXPECT_THAT(asked_.words, IsEmpty()) << "the field has not been left yet";
  ClickImageAndSelect({"sign-2"});
  EXPECT_THAT(asked_.words, ElementsAre("text sign-1 Elephants!"));
  asked_.words.clear();
  // From then on the fields are those of the other one.
  ClickName();
  Type("b");
  ClickImage();
  EXPECT_THAT(asked_.words, ElementsAre("rename sign-2 sign-2b"));
}

TEST_F(FieldsOfEntities, AFieldWithoutAChangeChangesNothingOfTheNextEntity) {
  ClickName();
  ASSERT_TRUE(WritesText());
  ClickImageAndSelect({"sign-2"});
  EXPECT_THAT(asked_.words, IsEmpty());
}

TEST_F(FieldsOfEntities, AClickIntoNothingKeepsWhatWasWritten) {
  ClickText();
  Type("!");
  ClickImageAndSelect({});
  EXPECT_THAT(asked_.words, ElementsAre("text sign-1 Elephants!"));
}

TEST_F(FieldsOfEntities, SelectingAFurtherEntityKeepsWhatWasWritten) {
  ClickText();
  Type("!");
  ClickImageAndSelect({"sign-1", "sign-2"});
  EXPECT_THAT(asked_.words, ElementsAre("text sign-1 Elephants!"));
}

TEST_F(FieldsOfEntities, NothingIsWrittenToAnEntityOfAnotherMapWithTheSameName) {
  ClickText();
  Type("!");
  facts_.map_key = 2;
  Draw();
  ClickImage();
  EXPECT_THAT(asked_.words, IsEmpty());
}

TEST_F(FieldsOfEntities, AFieldIsWrittenOnWhileTheEntityGetsItsNewName) {
  ClickName();
  Type("b");
  ClickText();
  ASSERT_THAT(asked_.words, ElementsAre("rename sign-1 sign-1b"));
  Type("!");
  scene_.entities[0].name = "sign-1b";
  selection_.Rename("sign-1", "sign-1b");
  Draw();
  EXPECT_TRUE(WritesText());
  Type("?");
  ClickImageAndSelect({});
  EXPECT_THAT(asked_.words, ElementsAre("rename sign-1 sign-1b", "text sign-1b Elephants!?"));
}

TEST_F(FieldsOfEntities, CharactersThatAFieldCannotHoldStayWhenItIsLeft) {
  scene_.entities[0].signpost.text = "Elephants \U0001F418";
  scene_.entities[1].name = "fox \U0001F98A";
  Draw();
  ClickText();
  ClickImage();
  selection_.Set({scene_.entities[1].name});
  Draw();
  ClickName();
  ClickImage();
  EXPECT_THAT(asked_.words, IsEmpty());
}

TEST_F(FieldsOfEntities, NoTextIsWrittenForAWrongLanguage) {
  ClickLanguage();
  ASSERT_TRUE(WritesText());
  Type("d");
  ClickText();
  EXPECT_FALSE(WritesText());
  ClickLanguage();
  Type("e");
  ClickText();
  ASSERT_TRUE(WritesText());
  Type("Elefanten");
  ClickImage();
  EXPECT_THAT(asked_.words, ElementsAre("text sign-1 Elefanten in de"));
}

TEST_F(FieldsOfEntities, ATextThatIsTooLongStaysUntilItIsShortened) {
  scene_.entities[0].signpost.text = std::string(content::kMaxTextBytes, 'a');
  Draw();
  ClickText();
  Type("b");
  ClickImage();
  EXPECT_THAT(asked_.words, IsEmpty());
  Draw();
  ClickText();
  PressBackspace();
  ClickImage();
  ASSERT_EQ(asked_.words.size(), 1u);
  EXPECT_NE(asked_.words[0].find('b'), std::string::npos);
}

TEST_F(FieldsOfEntities, AfterThePanelWasClosedTheNameIsThatOfTheEntityThatIsSelectedThen) {
  ClickName();
  Type("b");
  is_panel_open_ = false;
  for (int i = 0; i < 3; ++i) Draw();
  selection_.Set({"sign-2"});
  section_.BeginRename();
  is_panel_open_ = true;
  for (int i = 0; i < 3; ++i) Draw();
  ASSERT_TRUE(WritesText());
  Type("Lions");  // The whole name is chosen at first.
  ClickImage();
  EXPECT_THAT(asked_.words, ElementsAre("rename sign-2 Lions"));
}

}  // namespace
}  // namespace docent::ui

// SPDX-License-Identifier: Apache-2.0
// Which map is chosen while one is renamed.
#include "ui/map_section.h"

#include <gmock/gmock.h>

#include "tests/ui/panel_without_screen.h"

namespace docent::ui {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;

// The first map of the list is chosen.
class ListOfMaps : public PanelWithoutScreen {
 protected:
  void List(const std::vector<std::string>& names) {
    facts_.maps.clear();
    for (const std::string& name : names) facts_.maps.emplace_back().name = name;
    for (int i = 0; i < 3; ++i) Draw();
  }
  void ChooseFirst() { Click(50, ImGui::GetStyle().WindowPadding.y + 0.5f * ImGui::GetTextLineHeight()); }
  void DrawPart() override { section_.Draw(facts_); }

  // Clicks behind the name in its field, which is below the list.
  void ClickName() {
    if (name_y_ > 0) return Click(kFieldX, name_y_);
    const auto rows = static_cast<float>(facts_.maps.size());
    name_y_ = ImGui::GetStyle().WindowPadding.y + rows * ImGui::GetTextLineHeightWithSpacing() + 8;
    for (; name_y_ < 0.5f * kHeight; name_y_ += 4) {
      Click(kFieldX, name_y_);
      if (WritesText()) return;
    }
    ADD_FAILURE() << "there is no field";
  }
  void Rename(const char* typed) {
    ClickName();
    Type(typed);
    ClickImage();
  }

  static constexpr float kFieldX = 200;
  MapSection section_{&asked_};
  float name_y_ = 0;  // Of the field, once it was found.
};

TEST_F(ListOfMaps, AMapThatCannotHaveTheNameStaysChosen) {
  List({"Hall", "Hall2"});
  ChooseFirst();
  Rename("2");
  EXPECT_THAT(asked_.words, ElementsAre("rename map Hall to Hall2"));
  asked_.words.clear();
  Rename("x");
  EXPECT_THAT(asked_.words, ElementsAre("rename map Hall to Hallx")) << "the field was reset";
}

TEST_F(ListOfMaps, AMapThatWasToHaveNoNameStaysChosen) {
  List({"H", "Room"});
  ChooseFirst();
  ClickName();
  PressBackspace();
  ClickImage();
  EXPECT_THAT(asked_.words, ElementsAre("rename map H to "));
  asked_.words.clear();
  Rename("x");
  EXPECT_THAT(asked_.words, ElementsAre("rename map H to Hx"));
}

TEST_F(ListOfMaps, ARenamedMapStaysChosenUnderItsNewName) {
  List({"Hall", "Room"});
  ChooseFirst();
  Rename("x");
  EXPECT_THAT(asked_.words, ElementsAre("rename map Hall to Hallx"));
  asked_.words.clear();
  for (int i = 0; i < 10; ++i) Draw();  // The list is made anew once a second.
  List({"Hallx", "Room"});
  Rename("y");
  EXPECT_THAT(asked_.words, ElementsAre("rename map Hallx to Hallxy"));
}

TEST_F(ListOfMaps, CharactersThatAFieldCannotHoldStayInTheName) {
  List({"Hall"});
  ChooseFirst();
  ClickName();
  ClickImage();
  List({"Hall \U0001F3DB"});
  ChooseFirst();
  ClickName();
  ClickImage();
  EXPECT_THAT(asked_.words, IsEmpty());
}

TEST_F(ListOfMaps, AQuestionAboutRemovalIsNotAnsweredForAnotherMap) {
  constexpr float kButtonX = 30, kStep = 4;
  List({"Hall", "Hall2"});
  ChooseFirst();
  ClickName();
  ClickImage();
  // From below the field on, a click asks the question, and a later one answers it.
  const float first_y = name_y_ + ImGui::GetFrameHeightWithSpacing();
  float answer_y = first_y;
  for (; answer_y < kHeight && asked_.words.empty(); answer_y += kStep) Click(kButtonX, answer_y);
  answer_y -= kStep;
  ASSERT_THAT(asked_.words, ElementsAre("remove map Hall"));
  asked_.words.clear();
  // The same again, but for the answer.
  for (float y = first_y; y < answer_y; y += kStep) Click(kButtonX, y);
  ASSERT_THAT(asked_.words, IsEmpty());
  Rename("2");
  EXPECT_THAT(asked_.words, ElementsAre("rename map Hall to Hall2"));
  Click(kButtonX, answer_y);
  EXPECT_THAT(asked_.words, Not(Contains("remove map Hall2")));
  EXPECT_THAT(asked_.words, Not(Contains("remove map Hall")));
}

}  // namespace
}  // namespace docent::ui

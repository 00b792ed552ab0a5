// SPDX-License-Identifier: Apache-2.0
#include "ui/space_section.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "ui/strings.h"

namespace docent::ui {
namespace {

void SpaceRemark(const char* text) {
  ImGui::PushTextWrapPos(0.0f);
  ImGui::TextDisabled("%s", text);
  ImGui::PopTextWrapPos();
}

}  // namespace

void SpaceSection::Draw(const AuthoringFacts& facts, AuthoringChoices* choices) {
  if (facts.scene == nullptr) return SpaceRemark(strings::kNoMapForSpace);
  const bool is_level = facts.scene->settings.up.has_value();
  SpaceRemark(is_level ? strings::kFloorKnown : strings::kFloorEstimated);
  if (choices->pick == MapPick::kFloor) {
    SpaceRemark(strings::kClickFloor);
  } else if (ImGui::Button(strings::kPickFloor)) {
    choices->pick = MapPick::kFloor;
  }
  if (is_level && ImGui::Button(strings::kForgetFloor)) actions_->ForgetUp();
  DrawScale(facts, choices);
  DrawEntrance(facts);
}

void SpaceSection::DrawScale(const AuthoringFacts& facts, AuthoringChoices* choices) {
  const double metres = facts.scene->settings.metres_per_unit;
  char text[64];
  std::snprintf(text, sizeof text, strings::kScaleKnown, metres);
  SpaceRemark(metres > 0 ? text : strings::kScaleUnknown);
  constexpr double kLeast = 0.001, kMost = 1000, kStep = 0.1;  // Metres; as the command accepts.
  ImGui::SetNextItemWidth(0.5f * ImGui::GetContentRegionAvail().x);
  ImGui::InputDouble(strings::kLength, &choices->length_m, kStep, 10 * kStep, "%.3f");
  choices->length_m = choices->length_m > 0 ? std::clamp(choices->length_m, kLeast, kMost) : kStep;
  if (choices->pick == MapPick::kMeasureFrom) {
    SpaceRemark(strings::kClickFirstPoint);
  } else if (choices->pick == MapPick::kMeasureTo) {
    SpaceRemark(strings::kClickSecondPoint);
  } else if (ImGui::Button(strings::kMeasure)) {
    // Both points are those of one image.
    choices->pick = MapPick::kMeasureFrom;
    choices->frozen = true;
  }
  if (metres > 0 && ImGui::Button(strings::kForgetScale)) actions_->ForgetScale();
}

void SpaceSection::DrawEntrance(const AuthoringFacts& facts) {
  const bool is_chosen = facts.scene->settings.entrance.has_value();
  SpaceRemark(is_chosen ? strings::kEntranceChosen : strings::kEntranceFirst);
  if (ImGui::Button(strings::kChooseEntrance)) actions_->SetEntrance(true);
  if (is_chosen && ImGui::Button(strings::kForgetEntrance)) actions_->SetEntrance(false);
}

}  // namespace docent::ui

// SPDX-License-Identifier: Apache-2.0
#include "ui/authoring_panel.h"

#include <imgui.h>
#include <imgui_stdlib.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "ui/strings.h"
#include "ui/theme.h"

namespace docent::ui {
namespace {

constexpr const char* kPanelWindow = "panel";

ImVec4 TextColor(const Color& color) {
  return {color.red, color.green, color.blue, color.alpha};
}

// Text that is broken into lines at the panel's edge.
void Wrapped(const char* text, const Color& color) {
  ImGui::PushStyleColor(ImGuiCol_Text, TextColor(color));
  ImGui::PushTextWrapPos(0.0f);
  ImGui::TextUnformatted(text);
  ImGui::PopTextWrapPos();
  ImGui::PopStyleColor();
}

// Continues the line if a button with this label still fits into it.
void SameLineIfFits(const char* label, float extra = 0) {
  const ImGuiStyle& style = ImGui::GetStyle();
  const float width = ImGui::CalcTextSize(label).x + 2 * style.FramePadding.x + extra;
  const float end = ImGui::GetItemRectMax().x + style.ItemSpacing.x + width;
  if (end < ImGui::GetWindowPos().x + ImGui::GetContentRegionMax().x) ImGui::SameLine();
}

bool ButtonInRow(const char* label) {
  SameLineIfFits(label);
  return ImGui::Button(label);
}

bool Section(const char* title) {
  return ImGui::CollapsingHeader(title, ImGuiTreeNodeFlags_DefaultOpen);
}

}  // namespace

std::string SavedText(const std::optional<double>& saved_ago_s) {
  if (!saved_ago_s) return strings::kNothingSaved;
  if (*saved_ago_s < 2) return strings::kSavedJustNow;
  char text[64];
  if (*saved_ago_s < 100) {
    std::snprintf(text, sizeof text, strings::kSavedSecondsAgo, static_cast<int>(*saved_ago_s));
  } else {
    std::snprintf(text, sizeof text, strings::kSavedMinutesAgo,
                  static_cast<int>(std::lround(*saved_ago_s / 60)));
  }
  return text;
}

std::string FreeMapName(const std::vector<MapFacts>& maps) {
  for (int number = 1;; ++number) {
    char name[32];
    std::snprintf(name, sizeof name, strings::kNumberedMap, number);
    const auto has_name = [&](const MapFacts& map) { return map.name == name; };
    if (std::none_of(maps.begin(), maps.end(), has_name)) return name;
  }
}

const char* AuthoringPanel::window_name() {
  return kPanelWindow;
}

void AuthoringPanel::Draw(const WindowLayout& layout, const AuthoringFacts& facts) {
  ImGui::SetNextWindowPos(ImVec2(static_cast<float>(layout.panel.x), static_cast<float>(layout.panel.y)));
  ImGui::SetNextWindowSize(
      ImVec2(static_cast<float>(layout.panel.width), static_cast<float>(layout.panel.height)));
  if (!layout.panel_open) ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, ImVec2(2, 8));
  ImGui::Begin(kPanelWindow, nullptr,
               ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoBringToFrontOnFocus);
  if (!layout.panel_open) {
    ImGui::PopStyleVar();
    if (ImGui::ArrowButton("open", ImGuiDir_Left)) choices_.panel_open = true;
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", strings::kShowPanel);
    ImGui::End();
    return;
  }
  DrawHeader(facts);
  if (Section(strings::kMap)) DrawMap(facts);
  if (ImGui::CollapsingHeader(strings::kSpace)) space_section_.Draw(facts, &choices_);
  if (map_section_.begins_rename()) ImGui::SetNextItemOpen(true);
  if (ImGui::CollapsingHeader(strings::kMaps)) map_section_.Draw(facts);
  if (Section(strings::kPlace)) DrawPlace(facts);
  if (Section(strings::kContents)) entity_section_.DrawContents(facts);
  if (Section(strings::kSelected)) {
    if (!facts.fit) entity_section_.DrawSelected(facts);
    fit_section_.Draw(facts);
  }
  if (Section(strings::kView)) DrawView();
  if (ImGui::CollapsingHeader(strings::kKeys)) {
    if (ImGui::BeginTable("keys", 2, ImGuiTableFlags_SizingFixedFit)) {
      for (const strings::KeyHelp& help : strings::kKeyHelp) {
        ImGui::TableNextColumn();
        ImGui::TextUnformatted(help.key);
        ImGui::TableNextColumn();
        ImGui::TextUnformatted(help.effect);
      }
      ImGui::EndTable();
    }
  }
  ImGui::End();
}

void AuthoringPanel::DrawHeader(const AuthoringFacts& facts) {
  if (ImGui::ArrowButton("close", ImGuiDir_Right)) choices_.panel_open = false;
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", strings::kHidePanel);
  ImGui::SameLine();
  ImGui::AlignTextToFramePadding();
  const std::string name = facts.map_name.empty() ? strings::kNoMap : facts.map_name;
  Wrapped(name.c_str(), theme::kText);
  // One line in any case, so that what is below does not move under the pointer with every save.
  const std::string saved = SavedText(facts.saved_ago_s);
  if (facts.unsaved) {
    Wrapped((std::string(strings::kUnsaved) + " · " + saved).c_str(), theme::kAccentText);
  } else {
    Wrapped(saved.c_str(), theme::kMutedText);
  }
  if (choices_.frozen) Wrapped(strings::kFrozen, theme::kAccentText);
}

void AuthoringPanel::StartMap(const AuthoringFacts& facts) {
  actions_->NewMap(choices_.map_name.empty() ? FreeMapName(facts.maps) : choices_.map_name);
  choices_.map_name.clear();
}

void AuthoringPanel::DrawMap(const AuthoringFacts& facts) {
  if (facts.map_name.empty()) Wrapped(strings::kBegin, theme::kAccentText);
  if (facts.starting) Wrapped(strings::kStarting, theme::kAccentText);
  const ImGuiStyle& style = ImGui::GetStyle();
  const float button = ImGui::CalcTextSize(strings::kNewMap).x + 2 * style.FramePadding.x;
  ImGui::SetNextItemWidth(-button - style.ItemSpacing.x);
  const bool entered = ImGui::InputTextWithHint("##map name", strings::kMapNameHint, &choices_.map_name,
                                                ImGuiInputTextFlags_EnterReturnsTrue);
  ImGui::SameLine();
  if (ImGui::Button(strings::kNewMap) || (entered && !choices_.map_name.empty())) StartMap(facts);
  ImGui::BeginDisabled(facts.map_name.empty());
  if (ImGui::Button(strings::kStopMap)) actions_->StopMap();
  if (ButtonInRow(strings::kUndo)) actions_->Undo();
  if (ButtonInRow(strings::kRedo)) actions_->Redo();
  ImGui::EndDisabled();
  if (ButtonInRow(strings::kSave)) actions_->Save();
}

void AuthoringPanel::DrawPlace(const AuthoringFacts& facts) {
  const auto tool_button = [&](const char* label, AuthoringTool tool) {
    if (ImGui::RadioButton(label, choices_.tool == tool)) choices_.tool = tool;
  };
  tool_button(strings::kToolSelect, AuthoringTool::kSelect);
  constexpr std::pair<const char*, AuthoringTool> kTools[] = {
      {strings::kToolModel, AuthoringTool::kModel},      {strings::kToolSignpost, AuthoringTool::kSignpost},
      {strings::kToolLabel, AuthoringTool::kLabel},      {strings::kToolImage, AuthoringTool::kImage},
      {strings::kToolSound, AuthoringTool::kSound},      {strings::kToolTrail, AuthoringTool::kTrail},
      {strings::kToolOccluder, AuthoringTool::kOccluder}};
  for (const auto& [label, tool] : kTools) {
    SameLineIfFits(label, ImGui::GetFrameHeight());
    tool_button(label, tool);
  }
  if (choices_.tool == AuthoringTool::kModel) DrawModelChoice(facts);
  if (choices_.tool == AuthoringTool::kSignpost) DrawSignChoice(facts);
  if (choices_.tool == AuthoringTool::kLabel) DrawLabelChoice();
  if (choices_.tool == AuthoringTool::kImage) DrawImageChoice();
  if (choices_.tool == AuthoringTool::kSound) DrawSoundChoice();
  if (choices_.tool == AuthoringTool::kTrail) Wrapped(strings::kClickToPlaceTrail, theme::kMutedText);
  if (choices_.tool == AuthoringTool::kOccluder) DrawOccluderChoice();
}

void AuthoringPanel::DrawFileField(const char* hint, content::AssetKind kind, std::string* file) {
  const ImGuiStyle& style = ImGui::GetStyle();
  ImGui::SetNextItemWidth(-ImGui::CalcTextSize(strings::kBrowse).x - 2 * style.FramePadding.x -
                          style.ItemSpacing.x);
  ImGui::InputTextWithHint("##file", hint, file);
  ImGui::SameLine();
  if (ImGui::Button(strings::kBrowse)) actions_->ChooseFile(kind);
}

void AuthoringPanel::DrawLabelChoice() {
  ImGui::InputTextMultiline("##label text", &choices_.label_text,
                            ImVec2(-1.0f, 3.5f * ImGui::GetTextLineHeight()));
  Wrapped(choices_.label_text.empty() ? strings::kWriteText : strings::kClickToPlaceLabel, theme::kMutedText);
}

void AuthoringPanel::DrawImageChoice() {
  DrawFileField(strings::kImageFileHint, content::AssetKind::kImage, &choices_.image_file);
  ImGui::Checkbox(strings::kUpright, &choices_.image_upright);
  Wrapped(choices_.image_file.empty() ? strings::kChooseImage : strings::kClickToPlaceImage,
          theme::kMutedText);
  Wrapped(strings::kDropFiles, theme::kMutedText);
}

void AuthoringPanel::DrawOccluderChoice() {
  using Shape = content::Occluder::Shape;
  constexpr std::pair<const char*, Shape> kShapes[] = {{strings::kShapePlane, Shape::kPlane},
                                                       {strings::kShapeBox, Shape::kBox},
                                                       {strings::kShapeCylinder, Shape::kCylinder}};
  for (const auto& [label, shape] : kShapes) {
    if (shape != Shape::kPlane) SameLineIfFits(label, ImGui::GetFrameHeight());
    if (ImGui::RadioButton(label, choices_.occluder_shape == shape)) choices_.occluder_shape = shape;
  }
  Wrapped(strings::kClickToPlaceOccluder, theme::kMutedText);
}

void AuthoringPanel::DrawSoundChoice() {
  DrawFileField(strings::kSoundFileHint, content::AssetKind::kSound, &choices_.sound_file);
  ImGui::SetNextItemWidth(-1.0f);
  ImGui::InputTextWithHint("##caption", strings::kCaptionHint, &choices_.caption);
  Wrapped(choices_.sound_file.empty() ? strings::kChooseSound
          : choices_.caption.empty()  ? strings::kWriteCaption
                                      : strings::kClickToPlaceSound,
          theme::kMutedText);
}

void AuthoringPanel::DrawModelChoice(const AuthoringFacts& facts) {
  DrawFileField(strings::kModelFileHint, content::AssetKind::kModel, &choices_.model_file);
  if (facts.files != nullptr && !facts.files->empty()) {
    Wrapped(strings::kFiles, theme::kMutedText);
    const float rows = static_cast<float>(std::min<std::size_t>(facts.files->size(), 5));
    if (ImGui::BeginChild("files", ImVec2(0, rows * ImGui::GetTextLineHeightWithSpacing() + 4))) {
      for (const std::string& file : *facts.files) {
        const std::string label = std::filesystem::path(file).filename().string() + "##" + file;
        if (ImGui::Selectable(label.c_str(), choices_.model_file == file)) choices_.model_file = file;
        if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", file.c_str());
      }
    }
    ImGui::EndChild();
  }
  ImGui::Checkbox(strings::kAutomaticSize, &choices_.automatic_size);
  ImGui::PushItemWidth(0.55f * ImGui::GetContentRegionAvail().x);
  constexpr double kScaleStep = 0.1, kYawStep = 15.0, kLeast = 1e-6, kMost = 1e6;
  if (!choices_.automatic_size) {
    ImGui::InputDouble(strings::kScale, &choices_.scale, kScaleStep, 10 * kScaleStep, "%.3g");
    choices_.scale = choices_.scale > 0 ? std::clamp(choices_.scale, kLeast, kMost) : kScaleStep;
  }
  ImGui::InputDouble(strings::kTurn, &choices_.yaw_deg, kYawStep, 6 * kYawStep, strings::kDegrees);
  choices_.yaw_deg = std::isfinite(choices_.yaw_deg) ? std::remainder(choices_.yaw_deg, 360.0) : 0.0;
  ImGui::PopItemWidth();
  Wrapped(strings::kClickToPlaceModel, theme::kMutedText);
  Wrapped(strings::kDropFiles, theme::kMutedText);
}

void AuthoringPanel::DrawSignChoice(const AuthoringFacts& facts) {
  ImGui::InputTextMultiline("##sign text", &choices_.sign_text,
                            ImVec2(-1.0f, 3.5f * ImGui::GetTextLineHeight()));
  ImGui::SetNextItemWidth(0.6f * ImGui::GetContentRegionAvail().x);
  DrawMapChoice(strings::kLeadsTo, facts.maps, &choices_.sign_to_map);
  Wrapped(choices_.sign_text.empty() ? strings::kWriteText : strings::kClickToPlaceSign, theme::kMutedText);
}

void AuthoringPanel::DrawView() {
  ImGui::Checkbox(strings::kFreeze, &choices_.frozen);
  ImGui::Checkbox(strings::kFromAbove, &choices_.from_above);
  SameLineIfFits(strings::kCoverage);
  ImGui::Checkbox(strings::kCoverage, &choices_.show_coverage);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", strings::kCoverageHelp);
  ImGui::Checkbox(strings::kMapPoints, &choices_.show_points);
  SameLineIfFits(strings::kKeyframes);
  ImGui::Checkbox(strings::kKeyframes, &choices_.show_keyframes);
  ImGui::Checkbox(strings::kBoundary, &choices_.show_boundary);
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", strings::kBoundaryHelp);
  SameLineIfFits(strings::kStatus);
  ImGui::Checkbox(strings::kStatus, &choices_.show_status);
  if (ButtonInRow(strings::kFullScreen)) actions_->ToggleFullScreen();
}

}  // namespace docent::ui

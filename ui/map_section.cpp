// SPDX-License-Identifier: Apache-2.0
#include "ui/map_section.h"

#include <imgui.h>
#include <imgui_stdlib.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "ui/entity_section.h"
#include "ui/strings.h"
#include "ui/theme.h"

namespace docent::ui {
namespace {

// Text in grey that is broken into lines.
void MapRemark(const char* text) {
  ImGui::PushTextWrapPos(0.0f);
  ImGui::TextDisabled("%s", text);
  ImGui::PopTextWrapPos();
}

char LowerCase(char letter) {
  return letter >= 'A' && letter <= 'Z' ? static_cast<char>(letter - 'A' + 'a') : letter;
}

bool HasMap(const AuthoringFacts& facts, const std::string& name) {
  return std::any_of(facts.maps.begin(), facts.maps.end(),
                     [&](const MapFacts& map) { return map.name == name; });
}

}  // namespace

bool MatchesFilter(const std::string& name, const std::string& filter) {
  return std::search(name.begin(), name.end(), filter.begin(), filter.end(),
                     [](char a, char b) { return LowerCase(a) == LowerCase(b); }) != name.end() ||
         filter.empty();
}

void MapSection::Draw(const AuthoringFacts& facts) {
  if (begins_rename_) {
    chosen_ = name_ = facts.map_name;
    asked_name_.clear();
    asks_removal_ = false;
    filter_.clear();
  }
  if (facts.maps.empty()) return MapRemark(strings::kNoMaps);
  constexpr std::size_t kFilterFrom = 8;  // Fewer maps are seen at once.
  if (facts.maps.size() >= kFilterFrom) {
    ImGui::SetNextItemWidth(-1);
    ImGui::InputTextWithHint("##map filter", strings::kFindMap, &filter_);
  } else {
    filter_.clear();
  }
  FollowRename(facts);
  DrawList(facts);
  const auto found = std::find_if(facts.maps.begin(), facts.maps.end(),
                                  [&](const MapFacts& map) { return map.name == chosen_; });
  if (found == facts.maps.end()) {
    chosen_.clear();
    asks_removal_ = begins_rename_ = false;
    return MapRemark(strings::kChooseMap);
  }
  DrawChosen(*found, facts);
}

void MapSection::DrawList(const AuthoringFacts& facts) {
  const float rows = static_cast<float>(std::clamp<std::size_t>(facts.maps.size(), 1, 7));
  if (ImGui::BeginChild("maps", ImVec2(0, rows * ImGui::GetTextLineHeightWithSpacing() + 6))) {
    for (const MapFacts& map : facts.maps) {
      if (!MatchesFilter(map.name, filter_)) continue;
      const bool is_current = map.name == facts.map_name;
      const std::string label = (is_current ? "> " : "") + map.name + "##" + map.name;
      if (ImGui::Selectable(label.c_str(), chosen_ == map.name)) {
        chosen_ = chosen_ == map.name ? "" : map.name;
        name_ = chosen_;
        asked_name_.clear();
        asks_removal_ = false;
      }
    }
  }
  ImGui::EndChild();
}

void MapSection::FollowRename(const AuthoringFacts& facts) {
  if (asked_name_.empty() || HasMap(facts, chosen_) || !HasMap(facts, asked_name_)) return;
  chosen_ = std::exchange(asked_name_, {});
}

void MapSection::DrawChosen(const MapFacts& map, const AuthoringFacts& facts) {
  const bool is_current = map.name == facts.map_name;
  char size[96];
  std::snprintf(size, sizeof size, strings::kMapSize, static_cast<unsigned long>(map.keyframes),
                static_cast<unsigned long>(map.objects));
  MapRemark(map.objects_known ? size : strings::kNotInMemory);
  if (map.is_initialized && !is_current && ImGui::Button(strings::kContinueMap)) actions_->UseMap(map.name);
  if (map.is_initialized && !is_current && !facts.map_name.empty()) {
    if (ImGui::Button(strings::kJoinMap)) actions_->JoinMap(map.name);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", strings::kJoinMapHelp);
  }
  DrawName(map, facts);
  if (map.is_initialized) DrawPolicy(map);
  DrawRemoval(map);
}

void MapSection::DrawName(const MapFacts& map, const AuthoringFacts& facts) {
  ImGui::SetNextItemWidth(0.65f * ImGui::GetContentRegionAvail().x);
  if (std::exchange(begins_rename_, false)) ImGui::SetKeyboardFocusHere();
  const bool can_hold = FieldCanHold(name_);
  ImGui::InputText(strings::kRename, &name_, can_hold ? 0 : ImGuiInputTextFlags_ReadOnly);
  if (!can_hold) return MapRemark(strings::kMapNotWritableHere);
  // When the field is left.
  if (!ImGui::IsItemDeactivatedAfterEdit() || name_ == map.name) return;
  asks_removal_ = false;
  actions_->RenameMap(map.name, name_);
  // A map without a name, or with that of another one, is refused: its field is reset, and it stays chosen.
  const bool is_refused = name_.empty() || HasMap(facts, name_);
  asked_name_ = is_refused ? "" : name_;
  if (is_refused) name_ = map.name;
}

void MapSection::DrawPolicy(const MapFacts& map) {
  ImGui::SetNextItemWidth(0.65f * ImGui::GetContentRegionAvail().x);
  if (!ImGui::BeginCombo(strings::kPolicy, strings::PolicyLabel(map.policy.c_str()))) return;
  for (const strings::PolicyText& text : strings::kPolicies) {
    const bool is_this = map.policy == text.policy;
    if (ImGui::Selectable(text.label, is_this) && !is_this) actions_->SetPolicy(map.name, text.policy);
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", text.explanation);
  }
  ImGui::EndCombo();
}

void MapSection::DrawRemoval(const MapFacts& map) {
  if (!asks_removal_) {
    if (ImGui::Button(strings::kRemoveMap)) asks_removal_ = true;
    return;
  }
  MapRemark(strings::kRemoveMapQuestion);
  if (ImGui::Button(strings::kRemoveMapNow)) {
    actions_->RemoveMap(map.name);
    asked_name_.clear();
    asks_removal_ = false;
  }
  ImGui::SameLine();
  if (ImGui::Button(strings::kCancel)) asks_removal_ = false;
}

}  // namespace docent::ui

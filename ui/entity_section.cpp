// SPDX-License-Identifier: Apache-2.0
#include "ui/entity_section.h"

#include <imgui.h>
#include <imgui_stdlib.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "ui/entity_shapes.h"
#include "ui/strings.h"

namespace docent::ui {
namespace {

constexpr double kRadPerDegree = std::numbers::pi / 180;

void Remark(const char* text) {
  ImGui::PushTextWrapPos(0.0f);
  ImGui::TextDisabled("%s", text);
  ImGui::PopTextWrapPos();
}

bool RowButton(const char* label) {
  const ImGuiStyle& style = ImGui::GetStyle();
  const float end = ImGui::GetItemRectMax().x + style.ItemSpacing.x + ImGui::CalcTextSize(label).x +
                    2 * style.FramePadding.x;
  if (end < ImGui::GetWindowPos().x + ImGui::GetContentRegionMax().x) ImGui::SameLine();
  return ImGui::Button(label);
}

const char* SizeLabel(content::Entity::Kind kind) {
  if (kind == content::Entity::Kind::kSound) return strings::kRange;
  return kind == content::Entity::Kind::kTrail ? strings::kWidth : strings::kSize;
}

// The number of sides that a person chooses.
int SidesOf(const content::Occluder& occluder) {
  return occluder.shape == content::Occluder::Shape::kBox ? 3 : 2;
}

// The first text of an entity, or its variant in a language, which is empty if there is none.
std::string TextIn(const content::Entity& entity, const std::string& language) {
  const std::string* const text = content::TextOf(entity);
  if (text == nullptr || language.empty()) return text != nullptr ? *text : "";
  const content::Translations& translations = *content::TranslationsOf(entity);
  const auto found = translations.find(language);
  return found != translations.end() ? found->second : "";
}

// "de, es" of two languages.
std::string Joined(const std::vector<std::string>& languages) {
  std::string joined;
  for (const std::string& language : languages) joined += (joined.empty() ? "" : ", ") + language;
  return joined;
}

// Three numbers in a row. Returns whether a change of one of them was completed.
bool NumberFields(const char* label, double* values, int count, const char* format) {
  ImGui::TextUnformatted(label);
  const float spacing = ImGui::GetStyle().ItemInnerSpacing.x;
  const float width = (ImGui::GetContentRegionAvail().x - spacing * static_cast<float>(count - 1)) /
                      static_cast<float>(count);
  bool completed = false;
  ImGui::PushID(label);
  for (int i = 0; i < count; ++i) {
    if (i > 0) ImGui::SameLine(0, spacing);
    ImGui::PushID(i);
    ImGui::SetNextItemWidth(width);
    ImGui::InputDouble("##number", &values[i], 0, 0, format);
    completed = ImGui::IsItemDeactivatedAfterEdit() || completed;
    ImGui::PopID();
  }
  ImGui::PopID();
  return completed;
}

}  // namespace

bool FieldCanHold(const std::string& text) {
  constexpr unsigned char kLeastLead = 0xF0;  // Of four bytes in UTF-8.
  return sizeof(ImWchar) > 2 ||
         std::ranges::none_of(text, [](char c) { return static_cast<unsigned char>(c) >= kLeastLead; });
}

bool DrawMapChoice(const char* label, const std::vector<MapFacts>& maps, std::string* chosen) {
  const std::string before = *chosen;
  if (ImGui::BeginCombo(label, chosen->empty() ? strings::kLeadsNowhere : chosen->c_str())) {
    if (ImGui::Selectable(strings::kLeadsNowhere, chosen->empty())) chosen->clear();
    for (const MapFacts& map : maps) {
      if (ImGui::Selectable(map.name.c_str(), *chosen == map.name)) *chosen = map.name;
    }
    ImGui::EndCombo();
  }
  return *chosen != before;
}

Eigen::Vector3d AnglesOf(const engine::Rotation3& rotation) {
  // R = Ry(up) Rx(right) Rz(front).
  const Eigen::Matrix3d m = rotation.matrix();
  const double right = std::asin(std::clamp(-m(1, 2), -1.0, 1.0));
  double up, front = 0;
  if (std::abs(m(1, 2)) < 1 - 1e-9) {
    up = std::atan2(m(0, 2), m(2, 2));
    front = std::atan2(m(1, 0), m(1, 1));
  } else {  // The first and last axis coincide.
    up = std::atan2(-m(2, 0), m(0, 0));
  }
  return Eigen::Vector3d(up, right, front) / kRadPerDegree;
}

engine::Rotation3 RotationOf(const Eigen::Vector3d& angles_deg) {
  const Eigen::Vector3d angles = kRadPerDegree * angles_deg;
  return engine::Rotation3::Exp(Eigen::Vector3d::UnitY() * angles.x()) *
         engine::Rotation3::Exp(Eigen::Vector3d::UnitX() * angles.y()) *
         engine::Rotation3::Exp(Eigen::Vector3d::UnitZ() * angles.z());
}

void EntitySection::DrawContents(const AuthoringFacts& facts) {
  if (facts.scene == nullptr || facts.scene->entities.empty()) return Remark(strings::kNothingPlaced);
  const auto& entities = facts.scene->entities;
  languages_ = content::LanguagesOf(*facts.scene);
  constexpr int kMostRows = 7;
  const float rows = static_cast<float>(std::min<std::size_t>(entities.size(), kMostRows) + 1);
  constexpr ImGuiTableFlags kFlags = ImGuiTableFlags_ScrollY | ImGuiTableFlags_RowBg |
                                     ImGuiTableFlags_SizingFixedFit | ImGuiTableFlags_NoPadOuterX;
  if (!ImGui::BeginTable("contents", 5, kFlags, ImVec2(0, rows * (ImGui::GetFrameHeight() + 4)))) return;
  ImGui::TableSetupScrollFreeze(0, 1);
  ImGui::TableSetupColumn(strings::kName, ImGuiTableColumnFlags_WidthStretch);
  for (const char* title : {strings::kKind, strings::kShown, strings::kLocked, strings::kDistance})
    ImGui::TableSetupColumn(title);
  ImGui::TableHeadersRow();
  ImGuiListClipper clipper;
  clipper.Begin(static_cast<int>(entities.size()));
  while (clipper.Step()) {
    for (int i = clipper.DisplayStart; i < clipper.DisplayEnd; ++i)
      DrawRow(entities[static_cast<std::size_t>(i)], facts);
  }
  ImGui::EndTable();
}

void EntitySection::DrawRow(const content::Entity& entity, const AuthoringFacts& facts) {
  ImGui::PushID(entity.name.c_str());
  ImGui::TableNextRow();
  ImGui::TableNextColumn();
  ImGui::PushStyleVar(ImGuiStyleVar_SelectableTextAlign, ImVec2(0, 0.5f));
  const std::string missing = Joined(content::MissingLanguages(entity, languages_));
  std::string row = entity.name;
  if (!missing.empty()) row += strings::kRowWithoutLanguages + missing + ")";
  if (ImGui::Selectable((row + "###row").c_str(), facts.selection->Contains(entity.name),
                        ImGuiSelectableFlags_AllowItemOverlap, ImVec2(0, ImGui::GetFrameHeight())))
    actions_->Select(entity.name, ImGui::GetIO().KeyShift || ImGui::GetIO().KeyCtrl);
  ImGui::PopStyleVar();
  if (ImGui::IsItemHovered() && !entity.group.empty()) ImGui::SetTooltip("%s", entity.group.c_str());
  ImGui::TableNextColumn();
  ImGui::AlignTextToFramePadding();
  ImGui::TextDisabled("%s", strings::NameOf(entity.kind));
  ImGui::TableNextColumn();
  bool shown = !entity.hidden;
  if (ImGui::Checkbox("##shown", &shown)) actions_->SetHidden({entity.name}, !shown);
  ImGui::TableNextColumn();
  bool locked = entity.locked;
  if (ImGui::Checkbox("##locked", &locked)) actions_->SetLocked({entity.name}, locked);
  ImGui::TableNextColumn();
  ImGui::AlignTextToFramePadding();
  if (facts.has_pose) ImGui::Text("%.2f", (facts.camera_from_map * content::PlaceOf(entity)).norm());
  ImGui::PopID();
}

void EntitySection::DrawSelected(const AuthoringFacts& facts) {
  // Nobody writes on in a field that was not drawn, as while the panel was closed.
  const int frame = ImGui::GetFrameCount();
  if (std::exchange(last_frame_, frame) < frame - 1) is_writing_ = false;
  FollowRename(facts);
  if (const content::Entity* const shown = EntityToShow(facts)) {
    DrawFields(*shown, facts);
  } else {
    shown_.clear();
    is_writing_ = begin_rename_ = false;
  }
  const std::vector<std::string>& names = facts.selection->names();
  const content::Entity* const first =
      facts.scene != nullptr && !names.empty() ? facts.scene->Find(names.front()) : nullptr;
  if (first == nullptr) {
    Remark(strings::kNothingSelected);
    ImGui::BeginDisabled(!facts.has_copy);
    if (ImGui::Button(strings::kPaste)) actions_->Paste();
    ImGui::EndDisabled();
    return;
  }
  if (names.size() > 1) ImGui::Text(strings::kManySelected, static_cast<int>(names.size()));
  DrawButtons(*first, facts);
}

const content::Entity* EntitySection::EntityToShow(const AuthoringFacts& facts) const {
  if (facts.scene == nullptr) return nullptr;
  const content::Entity* const written =
      is_writing_ && shown_map_ == facts.map_key ? facts.scene->Find(shown_) : nullptr;
  if (written != nullptr) return written;
  const std::vector<std::string>& names = facts.selection->names();
  return names.size() == 1 ? facts.scene->Find(names.front()) : nullptr;
}

void EntitySection::FollowRename(const AuthoringFacts& facts) {
  if (asked_name_.empty() || facts.scene == nullptr || shown_map_ != facts.map_key) return;
  if (facts.scene->Find(shown_) != nullptr || facts.scene->Find(asked_name_) == nullptr) return;
  shown_ = std::exchange(asked_name_, {});
}

void EntitySection::Fill(const content::Entity& entity, const AuthoringFacts& facts) {
  const bool other = shown_ != entity.name || shown_map_ != facts.map_key;
  if (is_writing_ && !other) return;
  if (other) {
    shown_ = entity.name;
    shown_map_ = facts.map_key;
    fields_id_ = std::to_string(shown_map_) + " " + shown_;
    asked_name_.clear();
    language_.clear();
  }
  name_ = entity.name;
  if (other || text_.size() <= content::kMaxTextBytes)
    text_ = TextIn(entity, content::LanguageTag(language_));
  for (int i = 0; i < 3; ++i) offset_[i] = entity.label.offset[i];
  for (int i = 0; i < 3; ++i) sides_[i] = entity.occluder.size[i];
  const Eigen::Vector3d direction = entity.signpost.direction.value_or(Eigen::Vector3d::Zero());
  for (int i = 0; i < 3; ++i) direction_[i] = direction[i];
  const engine::Sim3 pose = TransformOf(entity, facts.camera_from_map.OriginInSource());
  const Eigen::Vector3d angles = AnglesOf(facts.map_from_upright.inverse() * pose.rotation);
  for (int i = 0; i < 3; ++i) {
    position_[i] = pose.translation[i];
    angles_deg_[i] = angles[i];
  }
  size_ = pose.scale;
}

void EntitySection::DrawFields(const content::Entity& entity, const AuthoringFacts& facts) {
  Fill(entity, facts);
  is_writing_ = false;
  ImGui::PushID(fields_id_.c_str());
  ImGui::BeginDisabled(entity.locked);
  DrawName(entity, facts);
  if (content::TextOf(entity) != nullptr) DrawText(entity);
  if (entity.kind == content::Entity::Kind::kSignpost) DrawSignpost(entity, facts);
  DrawLabelAndTrail(entity);
  DrawPose(entity, facts);
  ImGui::EndDisabled();
  ImGui::PopID();
}

void EntitySection::DrawName(const content::Entity& entity, const AuthoringFacts& facts) {
  ImGui::SetNextItemWidth(-1.0f);
  if (std::exchange(begin_rename_, false)) ImGui::SetKeyboardFocusHere();
  const bool can_hold = FieldCanHold(name_);
  ImGui::InputText("##name", &name_, can_hold ? 0 : ImGuiInputTextFlags_ReadOnly);
  is_writing_ = ImGui::IsItemActive();
  if (!can_hold) return Remark(strings::kNotWritableHere);
  if (!ImGui::IsItemDeactivatedAfterEdit() || name_ == entity.name || name_.empty()) return;
  // A name that another entity has is refused.
  if (facts.scene->Find(name_) == nullptr) asked_name_ = name_;
  actions_->Rename(entity.name, name_);
}

// The text and, below it, the language whose variant it is.
void EntitySection::DrawText(const content::Entity& entity) {
  const std::string tag = content::LanguageTag(language_);
  const bool is_valid = language_.empty() || !tag.empty();
  const bool can_hold = FieldCanHold(text_);
  // What is written for no language would be lost.
  ImGui::BeginDisabled(!is_valid);
  ImGui::InputTextMultiline("##text", &text_, ImVec2(-1.0f, 3.5f * ImGui::GetTextLineHeight()),
                            can_hold ? 0 : ImGuiInputTextFlags_ReadOnly);
  is_writing_ = ImGui::IsItemActive() || is_writing_;
  const bool completed = ImGui::IsItemDeactivatedAfterEdit();
  ImGui::EndDisabled();
  const bool is_too_long = text_.size() > content::kMaxTextBytes;
  const std::string shown = TextIn(entity, tag);
  // An empty text removes the variant of a language.
  if (completed && is_valid && !is_too_long && text_ != shown && (!text_.empty() || !tag.empty()))
    actions_->SetText(entity.name, text_, tag);
  ImGui::SetNextItemWidth(-1.0f);
  if (ImGui::InputTextWithHint("##language", strings::kLanguageHint, &language_))
    text_ = TextIn(entity, content::LanguageTag(language_));
  if (!is_valid) Remark(strings::kNoLanguage);
  if (!can_hold) Remark(strings::kNotWritableHere);
  if (is_too_long) Remark(strings::kTextTooLong);
  const std::string missing = Joined(content::MissingLanguages(entity, languages_));
  if (!missing.empty()) Remark((strings::kTextWithoutLanguages + missing + ".").c_str());
}

// The map that it leads to, and where its arrow points.
void EntitySection::DrawSignpost(const content::Entity& entity, const AuthoringFacts& facts) {
  std::string to_map = entity.signpost.to_map;
  ImGui::SetNextItemWidth(0.6f * ImGui::GetContentRegionAvail().x);
  if (DrawMapChoice(strings::kLeadsTo, facts.maps, &to_map)) actions_->SetTarget(entity.name, to_map);
  const bool has_arrow = entity.signpost.direction.has_value();
  ImGui::BeginDisabled(!facts.has_pose);
  if (ImGui::Button(strings::kLeaveHere)) actions_->PointAhead(entity.name);
  ImGui::EndDisabled();
  if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", strings::kLeaveHereHelp);
  if (has_arrow && RowButton(strings::kRemoveArrow)) actions_->SetDirection(entity.name, std::nullopt);
  if (!has_arrow && !to_map.empty()) Remark(strings::kNoArrow);
  ImGui::BeginGroup();
  const bool completed = NumberFields(strings::kArrowDirection, direction_, 3, "%.3g");
  ImGui::EndGroup();
  is_writing_ = ImGui::IsItemActive() || is_writing_;
  const Eigen::Vector3d direction(direction_[0], direction_[1], direction_[2]);
  if (completed && direction.allFinite() && direction.norm() > 0)
    actions_->SetDirection(entity.name, direction);
}

void EntitySection::DrawLabelAndTrail(const content::Entity& entity) {
  if (entity.kind == content::Entity::Kind::kLabel) {
    ImGui::BeginGroup();
    const bool completed = NumberFields(strings::kBoardOffset, offset_, 3, "%.4g");
    ImGui::EndGroup();
    is_writing_ = ImGui::IsItemActive() || is_writing_;
    const Eigen::Vector3d offset(offset_[0], offset_[1], offset_[2]);
    if (completed && offset.allFinite()) actions_->SetOffset(entity.name, offset);
  }
  if (entity.kind == content::Entity::Kind::kOccluder) DrawOccluder(entity);
  if (entity.kind != content::Entity::Kind::kTrail) return;
  ImGui::Text(strings::kTrailPoints, static_cast<int>(entity.trail.points.size()));
  ImGui::BeginDisabled(entity.trail.points.size() <= content::kMinTrailPoints);
  if (RowButton(strings::kRemoveLastPoint)) actions_->ShortenTrail(entity.name);
  ImGui::EndDisabled();
}

void EntitySection::DrawOccluder(const content::Entity& entity) {
  if (entity.occluder.shape == content::Occluder::Shape::kPolygon) return;
  ImGui::BeginGroup();
  const bool completed = NumberFields(strings::kSides, sides_, SidesOf(entity.occluder), "%.4g");
  ImGui::EndGroup();
  is_writing_ = ImGui::IsItemActive() || is_writing_;
  const Eigen::Vector3d size(sides_[0], sides_[1], sides_[2]);
  if (completed && size.allFinite()) actions_->SetOccluderSize(entity.name, size);
}

void EntitySection::DrawPose(const content::Entity& entity, const AuthoringFacts& facts) {
  ImGui::BeginGroup();
  bool completed = NumberFields(strings::kPosition, position_, 3, "%.4g");
  const bool has_axes = content::HasModel(entity) || entity.kind == content::Entity::Kind::kOccluder;
  if (has_axes || entity.kind == content::Entity::Kind::kTrail)
    completed = NumberFields(strings::kRotation, angles_deg_, 3, "%.1f°") || completed;
  completed = NumberFields(SizeLabel(entity.kind), &size_, 1, "%.4g") || completed;
  ImGui::EndGroup();
  is_writing_ = ImGui::IsItemActive() || is_writing_;
  if (has_axes && ImGui::Button(strings::kStandUpright)) {
    angles_deg_[1] = angles_deg_[2] = 0;
    completed = true;
  }
  if (!completed) return;
  const Eigen::Vector3d angles(angles_deg_[0], angles_deg_[1], angles_deg_[2]);
  engine::Sim3 pose = TransformOf(entity, facts.camera_from_map.OriginInSource());
  // The rotation stays exactly as it is unless an angle was written.
  const engine::Rotation3 before = facts.map_from_upright.inverse() * pose.rotation;
  if (!angles.allFinite() || (angles - AnglesOf(before)).norm() > 1e-6)
    pose.rotation = facts.map_from_upright * RotationOf(angles);
  pose.translation = {position_[0], position_[1], position_[2]};
  pose.scale = size_;
  if (pose.translation.allFinite() && angles.allFinite() && std::isfinite(size_) && size_ > 0)
    actions_->Transform({{entity.name, pose}});
}

void EntitySection::DrawButtons(const content::Entity& first, const AuthoringFacts& facts) {
  const std::vector<std::string> names = facts.selection->names();
  if (ImGui::Button(strings::kDuplicate)) actions_->DuplicateSelected();
  if (RowButton(strings::kCopy)) actions_->CopySelected();
  ImGui::BeginDisabled(!facts.has_copy);
  if (RowButton(strings::kPaste)) actions_->Paste();
  ImGui::EndDisabled();
  if (RowButton(strings::kDelete)) actions_->RemoveSelected();
  if (RowButton(first.locked ? strings::kUnlock : strings::kLock)) actions_->SetLocked(names, !first.locked);
  if (RowButton(first.hidden ? strings::kShow : strings::kHide)) actions_->SetHidden(names, !first.hidden);
  if (names.size() > 1 && RowButton(strings::kGroup)) actions_->Group(names);
  if (!first.group.empty() && RowButton(strings::kUngroup)) actions_->Ungroup(names);
}

}  // namespace docent::ui

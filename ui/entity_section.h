// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "ui/authoring_actions.h"

namespace docent::ui {

// The list of the entities of the map, and the fields of the selected one. Between Gui::Begin and Gui::Draw.
class EntitySection {
 public:
  // `actions` must outlive the section.
  explicit EntitySection(AuthoringActions* actions) : actions_(actions) {}

  void BeginRename() { begin_rename_ = true; }
  void DrawContents(const AuthoringFacts& facts);
  void DrawSelected(const AuthoringFacts& facts);

 private:
  void DrawRow(const content::Entity& entity, const AuthoringFacts& facts);
  // The entity whose fields are drawn: the one that is selected alone. While one of its fields is being
  // written, it stays the one that they belong to, so that what was typed becomes a change of that one: a
  // click in the image has selected another one before the field is left. Null for none.
  const content::Entity* EntityToShow(const AuthoringFacts& facts) const;
  // Lets the fields stay those of the entity that they belong to once it has the name that was asked for.
  void FollowRename(const AuthoringFacts& facts);
  void DrawFields(const content::Entity& entity, const AuthoringFacts& facts);
  void DrawName(const content::Entity& entity, const AuthoringFacts& facts);
  void DrawText(const content::Entity& entity);
  void DrawSignpost(const content::Entity& entity, const AuthoringFacts& facts);
  void DrawLabelAndTrail(const content::Entity& entity);
  void DrawOccluder(const content::Entity& entity);
  void DrawPose(const content::Entity& entity, const AuthoringFacts& facts);
  void DrawButtons(const content::Entity& first, const AuthoringFacts& facts);
  // Copies what the fields show from the entity, unless it is being written. A text that was too long to
  // become a change stays, so that it can be shortened.
  void Fill(const content::Entity& entity, const AuthoringFacts& facts);

  AuthoringActions* const actions_;
  bool begin_rename_ = false, is_writing_ = false;
  int last_frame_ = 0;           // Of Dear ImGui; in which the fields were drawn last.
  std::string shown_;            // The entity that the fields belong to; empty for none.
  std::uint64_t shown_map_ = 0;  // The map that it is in.
  std::string asked_name_;       // The new name of it that was asked for; empty for none.
  // By what Dear ImGui tells the fields of one entity from those of another. It stays when the entity gets
  // another name, so that a field that is being written keeps the keyboard.
  std::string fields_id_;
  std::string name_, text_;
  std::string language_;             // Of the text that is shown; empty for the first one.
  std::set<std::string> languages_;  // Those of the texts of the scene.
  double offset_[3] = {}, direction_[3] = {}, sides_[3] = {};
  double position_[3] = {}, angles_deg_[3] = {}, size_ = 1;
};

// A drop-down with the maps and "(nowhere)", the empty name. Returns whether *chosen changed.
bool DrawMapChoice(const char* label, const std::vector<MapFacts>& maps, std::string* chosen);

// Whether a field can be left with the same text in it: a Dear ImGui with characters of 16 bits replaces
// those above U+FFFF.
bool FieldCanHold(const std::string& text);

// A rotation as angles in degrees about up (y), right (x) and front (z), in this order, each about the
// rotated axes, and back.
Eigen::Vector3d AnglesOf(const engine::Rotation3& rotation);
engine::Rotation3 RotationOf(const Eigen::Vector3d& angles_deg);

}  // namespace docent::ui

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
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
  void DrawFields(const content::Entity& entity, const AuthoringFacts& facts);
  void DrawText(const content::Entity& entity);
  void DrawSignpost(const content::Entity& entity, const AuthoringFacts& facts);
  void DrawLabelAndTrail(const content::Entity& entity);
  void DrawOccluder(const content::Entity& entity);
  void DrawPose(const content::Entity& entity, const AuthoringFacts& facts);
  void DrawButtons(const content::Entity& first, const AuthoringFacts& facts);
  // Copies what the fields show from the entity, unless it is being written.
  void Fill(const content::Entity& entity, const AuthoringFacts& facts);

  AuthoringActions* const actions_;
  bool begin_rename_ = false, is_writing_ = false;
  std::string shown_;  // The entity that the fields belong to.
  std::string name_, text_;
  std::string language_;             // Of the text that is shown; empty for the first one.
  std::set<std::string> languages_;  // Those of the texts of the scene.
  double offset_[3] = {}, direction_[3] = {}, sides_[3] = {};
  double position_[3] = {}, angles_deg_[3] = {}, size_ = 1;
};

// A drop-down with the maps and "(nowhere)", the empty name. Returns whether *chosen changed.
bool DrawMapChoice(const char* label, const std::vector<MapFacts>& maps, std::string* chosen);

// A rotation as angles in degrees about up (y), right (x) and front (z), in this order, each about the
// rotated axes, and back.
Eigen::Vector3d AnglesOf(const engine::Rotation3& rotation);
engine::Rotation3 RotationOf(const Eigen::Vector3d& angles_deg);

}  // namespace docent::ui

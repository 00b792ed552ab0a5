// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/command_actions.h"

namespace docent::app {

void CommandActions::NewMap(const std::string& name) {
  emit_(app::NewMap{name});
}

void CommandActions::StopMap() {
  emit_(app::StopMap{});
}

void CommandActions::UseMap(const std::string& name) {
  emit_(app::UseMap{name});
}

void CommandActions::RenameMap(const std::string& name, const std::string& new_name) {
  emit_(app::RenameMap{name, new_name});
}

void CommandActions::RemoveMap(const std::string& name) {
  emit_(app::RemoveMap{name});
}

void CommandActions::JoinMap(const std::string& name) {
  emit_(app::JoinMap{name});
}

void CommandActions::Unbend(const std::string& name) {
  emit_(UnbendEntity{name});
}

void CommandActions::SetPolicy(const std::string& name, const std::string& policy) {
  if (const auto parsed = maps::ParsePolicy(policy)) emit_(app::SetPolicy{name, *parsed});
}

void CommandActions::Undo() {
  emit_(app::Undo{});
}

void CommandActions::Redo() {
  emit_(app::Redo{});
}

void CommandActions::Save() {
  emit_(app::Save{});
}

void CommandActions::Rename(const std::string& name, const std::string& new_name) {
  emit_(RenameEntity{name, new_name});
}

void CommandActions::SetText(const std::string& name, const std::string& text, const std::string& language) {
  emit_(SetEntityText{name, text, language});
}

void CommandActions::SetOffset(const std::string& name, const Eigen::Vector3d& offset) {
  emit_(SetLabelOffset{name, offset});
}

void CommandActions::SetOccluderSize(const std::string& name, const Eigen::Vector3d& size) {
  emit_(app::ResizeOccluder{name, size});
}

void CommandActions::ShortenTrail(const std::string& name) {
  emit_(app::ShortenTrail{name});
}

void CommandActions::SetTarget(const std::string& name, const std::string& to_map) {
  emit_(SetSignpostTarget{name, to_map});
}

void CommandActions::SetDirection(const std::string& name, const std::optional<Eigen::Vector3d>& direction) {
  emit_(SetSignpostDirection{name, direction});
}

void CommandActions::PointAhead(const std::string& name) {
  emit_(SetSignpostDirection{name, std::nullopt, true});
}

void CommandActions::SetLocked(const std::vector<std::string>& names, bool locked) {
  emit_(SetEntityFlag{names, content::EntityFlag::kLocked, locked});
}

void CommandActions::SetHidden(const std::vector<std::string>& names, bool hidden) {
  emit_(SetEntityFlag{names, content::EntityFlag::kHidden, hidden});
}

void CommandActions::Ungroup(const std::vector<std::string>& names) {
  emit_(GroupEntities{names, ""});
}

void CommandActions::Transform(const std::vector<ui::NewPose>& poses) {
  TransformEntities command;
  for (const auto& [name, map_from_entity] : poses) command.poses.push_back({name, map_from_entity});
  emit_(std::move(command));
}

void CommandActions::ForgetUp() {
  emit_(SetMapUp{});
}

void CommandActions::ForgetScale() {
  emit_(SetMapScale{});
}

void CommandActions::SetEntrance(bool here) {
  emit_(SetMapEntrance{here});
}

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#include "app/script/scene_commands.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <string_view>

#include "engine/base/error.h"

namespace docent::app {

content::SceneChange EditFor(const content::Scene& scene, const MoveEntity& command) {
  const content::Entity* const entity = scene.Find(command.name);
  if (entity == nullptr) throw Error("There is no '" + command.name + "' in this map.");
  return content::MoveEdit(scene, command.name, content::PlaceOf(*entity) + command.by_in_map);
}
content::SceneChange EditFor(const content::Scene& scene, const RotateEntity& command) {
  return content::RotateEdit(scene, command.name, command.angle_deg);
}
content::SceneChange EditFor(const content::Scene& scene, const ScaleEntity& command) {
  return content::ScaleEdit(scene, command.name, command.factor);
}
content::SceneChange EditFor(const content::Scene& scene, const TransformEntities& command) {
  content::SceneChange all;
  std::set<std::string_view> names;
  for (const auto& [name, map_from_entity] : command.poses) {
    if (!names.insert(name).second) throw Error("'" + name + "' is named twice.");
    engine::Sim3 pose = map_from_entity;
    pose.rotation = Settled(pose.rotation);
    content::SceneChange one = content::TransformEdit(scene, name, pose);
    if (all.label.empty()) all.label = one.label;
    std::move(one.entities.begin(), one.entities.end(), std::back_inserter(all.entities));
  }
  const std::size_t others = command.poses.size() - 1;
  if (others > 0) all.label += " and " + std::to_string(others) + (others == 1 ? " other" : " others");
  return all;
}
content::SceneChange EditFor(const content::Scene& scene, const UnbendEntity& command) {
  return content::UnbendEdit(scene, command.name);
}
content::SceneChange EditFor(const content::Scene& scene, const ShortenTrail& command) {
  return content::RemovePointEdit(scene, command.name);
}
content::SceneChange EditFor(const content::Scene& scene, const ResizeOccluder& command) {
  return content::SizeEdit(scene, command.name, command.size);
}
content::SceneChange EditFor(const content::Scene& scene, const SetLabelOffset& command) {
  return content::OffsetEdit(scene, command.name, command.offset);
}
content::SceneChange EditFor(const content::Scene& scene, const RemoveEntities& command) {
  return content::RemoveEdit(scene, command.names);
}
content::SceneChange EditFor(const content::Scene& scene, const DuplicateEntities& command) {
  return content::DuplicateEdit(scene, command.names);
}
content::SceneChange EditFor(const content::Scene& scene, const RenameEntity& command) {
  return content::RenameEdit(scene, command.name, command.new_name);
}
content::SceneChange EditFor(const content::Scene& scene, const SetEntityText& command) {
  return content::TextEdit(scene, command.name, command.text, command.language);
}
content::SceneChange EditFor(const content::Scene& scene, const SetEntityFlag& command) {
  return content::FlagEdit(scene, command.names, command.flag, command.value);
}
content::SceneChange EditFor(const content::Scene& scene, const GroupEntities& command) {
  return content::GroupEdit(scene, command.names, command.group);
}

}  // namespace docent::app

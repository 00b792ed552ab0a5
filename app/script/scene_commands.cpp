// SPDX-License-Identifier: Apache-2.0
#include "app/script/scene_commands.h"

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
content::SceneChange EditFor(const content::Scene& scene, const TransformEntity& command) {
  engine::Sim3 pose = command.map_from_entity;
  pose.rotation = Settled(pose.rotation);
  return content::TransformEdit(scene, command.name, pose);
}
content::SceneChange EditFor(const content::Scene& scene, const UnbendEntity& command) {
  return content::UnbendEdit(scene, command.name);
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
  return content::TextEdit(scene, command.name, command.text);
}
content::SceneChange EditFor(const content::Scene& scene, const SetEntityFlag& command) {
  return content::FlagEdit(scene, command.names, command.flag, command.value);
}
content::SceneChange EditFor(const content::Scene& scene, const GroupEntities& command) {
  return content::GroupEdit(scene, command.names, command.group);
}

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "content/scene.h"

// Changes of a scene that can be undone. Commands of people and scripts are app/script/commands.h, which the
// session turns into edits; command line tools apply edits to stored scenes. A scene is changed in no other
// way by people.
namespace docent::content {

class Edit {
 public:
  virtual ~Edit() = default;
  // Changes the scene and stores what Undo needs. Throws Error, without changing the scene, when the edit
  // does not fit the scene ("There is no 'helmet' in this map.").
  virtual void Apply(Scene* scene) = 0;
  // Reverts Apply exactly. The scene must be as Apply left it.
  virtual void Undo(Scene* scene) = 0;
  // Transforms the stored poses of the entity with this name after its anchor has moved in the map.
  virtual void MoveWithAnchor(const std::string& name, const engine::Sim3& motion) = 0;
};

// The entity's name must be unused (Scene::FreeName).
std::unique_ptr<Edit> AddEdit(Entity entity);
std::unique_ptr<Edit> MoveEdit(std::string name, const Eigen::Vector3d& position_in_map);
// About the entity's own up axis, counter-clockwise seen from above. Signposts cannot be rotated.
std::unique_ptr<Edit> RotateEdit(std::string name, double angle_deg);
// Relative to the entity's foot.
std::unique_ptr<Edit> ScaleEdit(std::string name, double factor);
std::unique_ptr<Edit> RemoveEdit(std::string name);

// Applies the edit. Throws Error, without changing the scene, when the edit does not fit the scene or the
// result could not be stored (see Validate in scene.h).
void ApplyChecked(Edit* edit, Scene* scene);

// The applied and undone edits of a scene, in order. Owned by the scene's owner.
class EditHistory {
 public:
  // Applies and stores the edit as ApplyChecked does, and discards the undone edits. If it throws, nothing
  // changes.
  void Do(std::unique_ptr<Edit> edit, Scene* scene);
  // Returns false when there is nothing to undo or redo. Redo throws like Do.
  bool Undo(Scene* scene);
  bool Redo(Scene* scene);

  // Transforms all applied and undone edits after the anchor of the entity with this name has moved in the
  // map.
  void MoveWithAnchor(const std::string& name, const engine::Sim3& motion);

 private:
  std::vector<std::unique_ptr<Edit>> done_, undone_;
};

}  // namespace docent::content

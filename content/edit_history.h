// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "content/scene.h"

// Changes of a scene as values, which can be applied, reverted and stored (history_codec.h). edits.h makes
// them. Not synchronized; a history belongs to the owner of its scene.
namespace docent::content {

// What becomes of one entity: it is added (no `before`), removed (no `after`) or replaced. An entity is found
// by its name; `index` says where in the list it is added, and where to look for it first.
struct EntityChange {
  std::size_t index = 0;
  std::optional<Entity> before, after;  // At least one.
};

// What becomes of the settings of a map.
struct SettingsChange {
  MapSettings before, after;
};

// One change of a scene, which is undone as a whole.
struct SceneChange {
  std::string label;                            // What it does, in words: "move 'fox'". UTF-8.
  std::vector<EntityChange> entities;           // In the order in which they are applied.
  std::optional<SettingsChange> settings = {};  // Empty: they stay as they are.
};

// The change that takes everything back.
SceneChange Reversed(const SceneChange& change);

// Applies a change. Throws Error, without changing the scene, when the change does not fit the scene ("There
// is no 'helmet' in this map."), or the result could not be stored (Validate in scene.h).
void ApplyChange(const SceneChange& change, Scene* scene);

// An entity that is not in the scene now: one that was removed, which undo restores, or one whose addition
// was undone, which redo restores. Valid until the history changes.
struct AbsentEntity {
  Entity entity;                      // As it is restored.
  bool undone = false;                // By redo.
  std::size_t change = 0, index = 0;  // Where in the history.
};

// The applied and undone changes of a scene, in order.
class EditHistory {
 public:
  EditHistory() = default;
  // `undone` is in the order in which the changes were undone: the last one is redone first.
  EditHistory(std::vector<SceneChange> done, std::vector<SceneChange> undone)
      : done_(std::move(done)), undone_(std::move(undone)) {}

  // Applies and stores the change as ApplyChange does, and discards the undone changes. If it throws, nothing
  // changes.
  void Do(SceneChange change, Scene* scene);
  // Return false when there is nothing to undo or redo. They throw like Do, where the scene was changed by
  // others meanwhile so that the change does not fit any more.
  bool Undo(Scene* scene);
  bool Redo(Scene* scene);

  // Transforms what is stored of an entity after its anchor has moved in the map. The entity has this name in
  // the scene now; changes of an earlier entity of that name stay as they are.
  void MoveWithAnchor(const std::string& name, const engine::Sim3& motion);
  // The entities that only undo or only redo would restore: at most so many of each, the first ones first.
  std::vector<AbsentEntity> Absent(std::size_t most) const;
  // Transforms what is stored of an entity that is not in the scene.
  void MoveWithAnchor(const AbsentEntity& absent, const engine::Sim3& motion);
  // Lets all stored states of signposts lead elsewhere after something has happened to maps, so that undo and
  // redo restore no target that is gone. `retarget` changes a signpost where it has to, and returns whether
  // it did. Returns whether it changed any.
  bool RetargetSignposts(const std::function<bool(Signpost*)>& retarget);
  // Adds an up direction and a scale that the map has got by other means than a change to all stored settings
  // that have none, so that undo and redo do not take them away. What `gained` does not have, and the
  // entrance, stay as they are.
  void AddSettings(const MapSettings& gained);

  const std::vector<SceneChange>& done() const { return done_; }
  const std::vector<SceneChange>& undone() const { return undone_; }
  // The names that entities have in the changes. Undo and redo may need each of them again.
  std::set<std::string> Names() const;
  // All assets that the changes need, each once, in the order of their ids.
  std::vector<std::shared_ptr<const Asset>> Assets() const;

 private:
  std::vector<SceneChange> done_, undone_;
};

}  // namespace docent::content

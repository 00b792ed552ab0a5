// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "content/scene.h"

// Commands that change a scene. Each can be applied, undone and written as one line of a script. The window,
// script files and tests change scenes only through these commands.
//
// Arguments in scripts (the words after the time; names and texts with blanks are in double quotes):
//   place FILE.glb at pixel U V [scale S] [yaw DEG]     the pixel in the frame of the line's time
//   signpost "TEXT" at pixel U V [to MAP]
//   move NAME X Y Z       to this position in the map, map units
//   rotate NAME DEG       by this angle in degrees about its own up axis, counter-clockwise seen from above
//   scale NAME FACTOR     by this factor, relative to its foot
//   remove NAME
namespace docent::content {

// The pixel at which an entity was placed, as scripts record it.
struct PixelRequest {
  double u_px = 0, v_px = 0;
};

class Edit {
 public:
  virtual ~Edit() = default;
  // Changes the scene and stores what Undo needs. Throws Error, without changing the scene, when the edit
  // does not fit the scene ("There is no 'helmet' in this map.").
  virtual void Apply(Scene* scene) = 0;
  // Reverts Apply exactly. The scene must be as Apply left it.
  virtual void Undo(Scene* scene) = 0;
  // One line of a script, without its time.
  virtual std::string Text() const = 0;
  // Transforms the stored poses of the entity with this name after its anchor has moved in the map.
  virtual void MoveWithAnchor(const std::string& name, const engine::Sim3& motion) = 0;
};

// The entity's name must be unused (Scene::FreeName). `file` is the model's file as scripts name it.
std::unique_ptr<Edit> PlaceModelEdit(Entity entity, std::string file, PixelRequest pixel,
                                     std::optional<double> scale = std::nullopt,
                                     std::optional<double> yaw_deg = std::nullopt);
std::unique_ptr<Edit> AddSignpostEdit(Entity entity, PixelRequest pixel);
std::unique_ptr<Edit> MoveEdit(std::string name, const Eigen::Vector3d& position_in_map);
std::unique_ptr<Edit> RotateEdit(std::string name, double angle_deg);
std::unique_ptr<Edit> ScaleEdit(std::string name, double factor);
std::unique_ptr<Edit> RemoveEdit(std::string name);

// The applied and undone edits of a scene, in order. Owned by the scene's owner.
class EditHistory {
 public:
  // Applies and stores the edit, and discards the undone edits. If Apply throws, nothing changes.
  void Do(std::unique_ptr<Edit> edit, Scene* scene);
  // Returns false when there is nothing to undo or redo.
  bool Undo(Scene* scene);
  bool Redo(Scene* scene);

  // Transforms all applied and undone edits after the anchor of the entity with this name has moved in the
  // map.
  void MoveWithAnchor(const std::string& name, const engine::Sim3& motion);

  bool can_undo() const { return !done_.empty(); }
  bool can_redo() const { return !undone_.empty(); }
  // The script lines of all applied edits, in order.
  std::vector<std::string> Lines() const;

 private:
  std::vector<std::unique_ptr<Edit>> done_, undone_;
};

}  // namespace docent::content

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "content/scene.h"

// Changes to a scene as command objects: each can be applied, undone, and written as one line of a script.
// The window, script files and tests all change a scene through these.
//
// Arguments in scripts (the words after the time; names and texts with blanks stand in double quotes):
//   place FILE.glb at pixel U V [scale S] [yaw DEG]     the pixel in the frame of the line's time
//   signpost "TEXT" at pixel U V [to MAP]
//   move NAME X Y Z       to this place in the map, metres
//   rotate NAME DEG       by this angle about its own up axis, counter-clockwise seen from above
//   scale NAME FACTOR     by this factor, about its foot
//   remove NAME
namespace docent::content {

// The pixel that a thing was placed at, as scripts record it.
struct PixelRequest {
  double u_px = 0, v_px = 0;
};

class Edit {
 public:
  virtual ~Edit() = default;
  // Changes the scene, and remembers what Undo needs. Throws Error with a sentence, the scene unchanged, when
  // the edit does not fit the scene ("there is no 'helmet' in this map").
  virtual void Apply(Scene* scene) = 0;
  // Takes Apply back exactly. The scene is as Apply left it.
  virtual void Undo(Scene* scene) = 0;
  // One line of a script, without its time.
  virtual std::string Text() const = 0;
  // The ground of the entity of this name has moved in the map: what is remembered of it moves along.
  virtual void MoveAlong(const std::string& name, const engine::Sim3& motion) = 0;
};

// The entity's name must be free (Scene::FreeName). `file` is the model's file as the script names it.
std::unique_ptr<Edit> PlaceModelEdit(Entity entity, std::string file, PixelRequest pixel,
                                     std::optional<double> scale = std::nullopt,
                                     std::optional<double> yaw_deg = std::nullopt);
std::unique_ptr<Edit> AddSignpostEdit(Entity entity, PixelRequest pixel);
std::unique_ptr<Edit> MoveEdit(std::string name, const Eigen::Vector3d& position_in_map);
std::unique_ptr<Edit> RotateEdit(std::string name, double angle_deg);
std::unique_ptr<Edit> ScaleEdit(std::string name, double factor);
std::unique_ptr<Edit> RemoveEdit(std::string name);

// What has been done to a scene, in order, and what of it was taken back. Belongs to whoever owns the scene.
class EditHistory {
 public:
  // Applies and keeps the edit; what had been undone can then no longer be redone. If Apply throws nothing
  // changes.
  void Do(std::unique_ptr<Edit> edit, Scene* scene);
  // False when there is nothing to undo or redo.
  bool Undo(Scene* scene);
  bool Redo(Scene* scene);

  // The ground of the entity of this name has moved in the map: all that was done and may be done again moves
  // along.
  void MoveAlong(const std::string& name, const engine::Sim3& motion);

  bool can_undo() const { return !done_.empty(); }
  bool can_redo() const { return !undone_.empty(); }
  // Script lines of all edits that stand, in order.
  std::vector<std::string> Lines() const;

 private:
  std::vector<std::unique_ptr<Edit>> done_, undone_;
};

}  // namespace docent::content

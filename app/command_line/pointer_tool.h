// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/command_line/author_view.h"
#include "ui/authoring_actions.h"
#include "ui/entity_shapes.h"
#include "ui/scene_overlay.h"

namespace docent::app {

// Selecting and dragging in the author's image. While a handle or an entity is dragged, only what is shown
// changes; the release asks for one change of all of them. On the window's thread.
class PointerTool {
 public:
  // `selection`, `shapes` and `actions` must outlive the tool.
  PointerTool(ui::Selection* selection, ui::EntityShapes* shapes, ui::AuthoringActions* actions)
      : selection_(selection), shapes_(shapes), actions_(actions) {}

  // The left button was pressed at a point of the window inside the image: holds a handle of the selected
  // entity, else selects the entity there and holds it. With `add`, it only changes the selection. One of
  // several selected entities is held with the others, and selected alone by a release without a motion.
  void Press(const AuthorView& view, const Eigen::Vector2d& point, bool add);
  // The pointer is at this point. A drag begins when it has moved by a few window units.
  void Move(const AuthorView& view, const Eigen::Vector2d& point, bool in_steps);
  void Release();
  // Ends a drag without a change. Returns whether there was one.
  bool Cancel();
  bool is_dragging() const { return drag_.has_value() && drag_->moved; }

  // The scene with the dragged entities where they are held; the scene itself without a drag.
  std::shared_ptr<const content::Scene> Preview(const std::shared_ptr<const content::Scene>& scene) const;
  // Outlines and names of what is selected in the previewed scene, and the handles.
  void Draw(const AuthorView& view, const content::Scene& preview, const Eigen::Vector2d& pointer,
            ui::SceneOverlay* overlay);

  // Moves what is selected along the ground as seen from the camera, by a hundredth of its distance: to the
  // right and away from the viewer by these steps. Steps before the scene shows the last one add up. Locked
  // entities stay if others are selected with them.
  void Nudge(const AuthorView& view, int right, int away);
  // A change was refused, which may have been that of a step.
  void ForgetSteps() { nudged_.clear(); }

 private:
  struct Drag {
    ui::GizmoDrag motion;
    std::vector<ui::NewPose> held;  // At the beginning of the drag.
    Eigen::Vector2d from;           // In the window.
    bool moved = false;
    std::string pressed = {};  // The entity that a release without a motion selects; empty for none.
  };

  // The handles of the selected entity; empty unless exactly one is selected that may be changed.
  std::optional<ui::Gizmo> SelectedGizmo(const AuthorView& view, const content::Scene& scene);
  void Hold(const AuthorView& view, const ui::Gizmo& gizmo, ui::GizmoPart part, const Eigen::Vector2d& point);
  // The entity at this pixel; null for none. Labels are drawn over everything else.
  const content::Entity* EntityAt(const AuthorView& view, const Eigen::Vector2d& pixel);

  ui::Selection* const selection_;
  ui::EntityShapes* const shapes_;
  ui::AuthoringActions* const actions_;
  std::optional<Drag> drag_;
  // The poses that Nudge asked for last, by name, and the scene that does not have them yet.
  std::map<std::string, engine::Sim3> nudged_;
  std::shared_ptr<const content::Scene> nudged_in_;
};

// The axes of the map's ground: right, up and towards the first viewer.
engine::Rotation3 UprightRotation(const content::Scene& scene, const engine::MapSnapshot& map);

}  // namespace docent::app

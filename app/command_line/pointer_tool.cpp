// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/pointer_tool.h"

#include <algorithm>
#include <utility>

#include "app/session/map_axes.h"

namespace docent::app {

namespace {

constexpr double kHandleLength = 90, kHandleReach = 9, kDragThreshold = 4;  // Window units at a scale of 1.

bool MayMove(const content::Entity& entity) {
  return !entity.locked && !entity.hidden;
}

// Where the handles are: at the base of what stands on a surface, else at the place.
Eigen::Vector3d OriginOf(const content::Entity& entity, const ui::PlacedBox& box) {
  const bool stands = content::HasModel(entity) || entity.kind == content::Entity::Kind::kSignpost;
  return stands ? box.Base() : content::PlaceOf(entity);
}

// The uppermost label that is drawn at this pixel and not hidden; null for none.
const content::Entity* LabelAt(const AuthorView& view, const Eigen::Vector2d& pixel) {
  if (view.labels == nullptr) return nullptr;
  for (auto label = view.labels->rbegin(); label != view.labels->rend(); ++label) {
    if (!label->area.contains(pixel)) continue;
    const content::Entity* const entity = view.scene->Find(label->entity);
    if (entity != nullptr && !entity->hidden) return entity;
  }
  return nullptr;
}

// Where the label is drawn, if it is.
void DrawLabelOutline(const AuthorView& view, const std::string& name, bool is_muted,
                      ui::SceneOverlay* overlay) {
  if (view.labels == nullptr) return;
  for (const ui::LabelArea& label : *view.labels) {
    if (label.entity == name) overlay->DrawOutline(label.area, name, is_muted);
  }
}

}  // namespace

engine::Rotation3 UprightRotation(const content::Scene& scene, const engine::MapSnapshot& map) {
  const engine::UprightAxes axes = AxesOf(scene, map);
  Eigen::Matrix3d columns;
  columns << axes.right, axes.up, -axes.ahead;
  return engine::Rotation3(columns);
}

std::optional<ui::Gizmo> PointerTool::SelectedGizmo(const AuthorView& view, const content::Scene& scene) {
  if (!view.has_pose() || selection_->names().size() != 1) return std::nullopt;
  const content::Entity* const entity = scene.Find(selection_->names().front());
  if (entity == nullptr || !MayMove(*entity)) return std::nullopt;
  const auto box = shapes_->BoxOf(*entity, view.eye());
  if (!box) return std::nullopt;
  ui::Gizmo gizmo;
  gizmo.origin = OriginOf(*entity, *box);
  gizmo.map_from_axes = box->map_from_box.rotation;
  gizmo.turns = content::HasModel(*entity) || entity->kind == content::Entity::Kind::kTrail ||
                entity->kind == content::Entity::Kind::kOccluder;
  const auto length = ui::GizmoLength(view.camera, gizmo.origin, kHandleLength * view.scale / view.box.scale);
  if (!length) return std::nullopt;
  gizmo.length = *length;
  return gizmo;
}

const content::Entity* PointerTool::EntityAt(const AuthorView& view, const Eigen::Vector2d& pixel) {
  if (!view.scene) return nullptr;
  if (const content::Entity* const label = LabelAt(view, pixel)) return label;
  const auto ray = view.RayAt(pixel);
  if (!ray) return nullptr;
  content::Scene shown = *view.scene;
  // The boards of labels are not where their shapes are: they are moved apart, and left out from afar.
  std::erase_if(shown.entities, [](const content::Entity& entity) {
    return entity.hidden || entity.kind == content::Entity::Kind::kLabel;
  });
  const auto pick = content::PickEntity(*ray, shown, shapes_->PickOptionsAt(view.frame->seconds));
  return pick ? view.scene->Find(shown.entities[pick->entity].name) : nullptr;
}

void PointerTool::Hold(const AuthorView& view, const ui::Gizmo& gizmo, ui::GizmoPart part,
                       const Eigen::Vector2d& point) {
  auto motion = ui::GizmoDrag::Begin(gizmo, part, view.camera, view.PixelAt(point));
  if (!motion) return;
  Drag drag{std::move(*motion), {}, point};
  for (const std::string& name : selection_->names()) {
    const content::Entity* const entity = view.scene->Find(name);
    if (entity != nullptr && MayMove(*entity))
      drag.held.push_back({name, ui::TransformOf(*entity, view.eye())});
  }
  if (!drag.held.empty()) drag_ = std::move(drag);
}

void PointerTool::Press(const AuthorView& view, const Eigen::Vector2d& point, bool add) {
  drag_.reset();
  if (!view.has_pose() || !view.scene) return;
  const Eigen::Vector2d pixel = view.PixelAt(point);
  if (const auto gizmo = SelectedGizmo(view, *view.scene); gizmo && !add) {
    const ui::GizmoPart part =
        ui::PartAt(*gizmo, view.camera, pixel, kHandleReach * view.scale / view.box.scale);
    if (part != ui::GizmoPart::kNone) return Hold(view, *gizmo, part, point);
  }
  const content::Entity* const entity = EntityAt(view, pixel);
  if (entity == nullptr) {
    if (!add) selection_->Clear();
    return;
  }
  const bool was_selected = selection_->Contains(entity->name);
  if (add || !was_selected) actions_->Select(entity->name, add);
  if (add) return;
  if (const auto box = MayMove(*entity) ? shapes_->BoxOf(*entity, view.eye()) : std::nullopt) {
    ui::Gizmo ground;
    ground.origin = OriginOf(*entity, *box);
    ground.map_from_axes = UprightRotation(*view.scene, *view.frame->tracked.map);
    ground.length = (ground.origin - view.eye()).norm();
    Hold(view, ground, ui::GizmoPart::kGround, point);
  }
  if (!was_selected) return;
  // Of several, it is selected alone unless they are dragged together.
  if (drag_) {
    drag_->pressed = entity->name;
  } else {
    actions_->Select(entity->name, false);
  }
}

void PointerTool::Move(const AuthorView& view, const Eigen::Vector2d& point, bool in_steps) {
  if (!drag_) return;
  if (!view.has_pose()) return;  // The entities stay where they are held.
  drag_->moved = drag_->moved || (point - drag_->from).norm() > kDragThreshold * view.scale;
  if (drag_->moved) drag_->motion.Update(view.camera, view.PixelAt(point), in_steps);
}

void PointerTool::Release() {
  const auto drag = std::exchange(drag_, std::nullopt);
  if (!drag) return;
  if (!drag->moved) {
    if (!drag->pressed.empty()) actions_->Select(drag->pressed, false);
    return;
  }
  std::vector<ui::NewPose> poses = drag->held;
  for (ui::NewPose& pose : poses) pose.map_from_entity = drag->motion.motion() * pose.map_from_entity;
  actions_->Transform(poses);
}

bool PointerTool::Cancel() {
  return std::exchange(drag_, std::nullopt).has_value();
}

std::shared_ptr<const content::Scene> PointerTool::Preview(
    const std::shared_ptr<const content::Scene>& scene) const {
  if (!scene || !is_dragging()) return scene;
  auto preview = std::make_shared<content::Scene>(*scene);
  for (content::Entity& entity : preview->entities) {
    for (const ui::NewPose& held : drag_->held) {
      if (held.name == entity.name) content::SetPose(drag_->motion.motion() * held.map_from_entity, &entity);
    }
  }
  return preview;
}

void PointerTool::Draw(const AuthorView& view, const content::Scene& preview, const Eigen::Vector2d& pointer,
                       ui::SceneOverlay* overlay) {
  if (!view.has_pose()) return;
  for (const std::string& name : selection_->names()) {
    const content::Entity* const entity = preview.Find(name);
    if (entity == nullptr) continue;
    const bool is_muted = entity->locked || entity->hidden;
    if (entity->kind == content::Entity::Kind::kLabel) {
      DrawLabelOutline(view, name, is_muted, overlay);
    } else if (const auto box = shapes_->BoxOf(*entity, view.eye())) {
      overlay->DrawOutline(*box, name, is_muted);
    }
  }
  const auto gizmo = SelectedGizmo(view, preview);
  if (!gizmo || (drag_ && drag_->motion.part() == ui::GizmoPart::kGround && is_dragging())) return;
  const ui::GizmoPart part = drag_ ? drag_->motion.part()
                                   : ui::PartAt(*gizmo, view.camera, view.PixelAt(pointer),
                                                kHandleReach * view.scale / view.box.scale);
  overlay->DrawGizmo(*gizmo, part);
}

void PointerTool::Nudge(const AuthorView& view, int right, int away) {
  constexpr double kShareOfDistance = 0.01;
  if (!view.has_pose() || !view.scene) return;
  const Eigen::Vector3d up = UpOf(*view.scene, *view.frame->tracked.map);
  const engine::Rotation3 map_from_camera = view.camera.camera_from_map.rotation.inverse();
  // The camera's right is level more often than its forward direction.
  Eigen::Vector3d level_right = map_from_camera * Eigen::Vector3d::UnitX();
  level_right -= up * up.dot(level_right);
  if (level_right.norm() < 1e-6) return;
  level_right.normalize();
  const Eigen::Vector3d level_away = up.cross(level_right);
  if (std::exchange(nudged_in_, view.scene) != view.scene) nudged_.clear();
  // Locked entities stay, unless nothing else is selected: then the refusal says why nothing moves.
  const std::vector<std::string>& names = selection_->names();
  const bool moves_any = std::any_of(names.begin(), names.end(), [&view](const std::string& name) {
    const content::Entity* const entity = view.scene->Find(name);
    return entity != nullptr && !entity->locked;
  });
  std::vector<ui::NewPose> poses;
  for (const std::string& name : names) {
    const content::Entity* const entity = view.scene->Find(name);
    if (entity == nullptr || (entity->locked && moves_any)) continue;
    const double step = kShareOfDistance * (content::PlaceOf(*entity) - view.eye()).norm();
    const Eigen::Vector3d offset = step * (right * level_right + away * level_away);
    engine::Sim3& pose = nudged_.try_emplace(name, ui::TransformOf(*entity, view.eye())).first->second;
    pose = ui::TranslationBy(offset) * pose;
    poses.push_back({name, pose});
  }
  if (!poses.empty()) actions_->Transform(poses);
}

}  // namespace docent::app

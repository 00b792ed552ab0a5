// SPDX-License-Identifier: Apache-2.0
#include "app/session/session_map.h"

#include <utility>

#include "ui/strings.h"

namespace docent::app {

void SessionMap::Discard() {
  discarded = true;
  saved_snapshot.reset();
  mesh.reset();
  light.reset();
  if (!snapshot) return;
  static const auto no_image = std::make_shared<const engine::ImageFeatures>();
  auto numbers = std::make_shared<engine::MapSnapshot>(*snapshot);
  for (engine::KeyFrame& keyframe : numbers->keyframes) keyframe.features = no_image;
  snapshot = std::move(numbers);
}

void SessionMap::UpdateSnapshot(std::shared_ptr<const engine::MapSnapshot> newer) {
  const auto before = std::exchange(snapshot, std::move(newer));
  SetMesh(std::move(mesh), std::move(light));
  std::shared_ptr<const content::Scene> moved = scene;
  if (before && snapshot && MoveContent(*before, *snapshot, &follower, &moved, &history))
    Follow(std::move(moved));
}

void SessionMap::Follow(std::shared_ptr<const content::Scene> moved) {
  if (content_left_out && scene == saved_scene) saved_scene = moved;
  scene = std::move(moved);
}

void SessionMap::SetMesh(std::shared_ptr<const engine::MapMesh> made,
                         std::shared_ptr<const engine::LightEstimate> light_on_it) {
  const bool fits =
      made && snapshot && engine::StateOf(made->keyframes, *snapshot) != engine::MeshState::kOutOfDate;
  mesh = fits ? std::move(made) : nullptr;
  light = fits ? std::move(light_on_it) : nullptr;
}

bool SessionMap::HasCurrentMesh() const {
  return mesh && snapshot && engine::StateOf(mesh->keyframes, *snapshot) == engine::MeshState::kCurrent;
}

std::string SessionMap::PolicyInWords() const {
  return "changes to the map '" + name +
         "' are limited to: " + ui::strings::PolicyLabel(maps::ToString(policy));
}

engine::MapPermissions SessionMap::Permissions() const {
  engine::MapPermissions permissions;
  permissions.extend = !stopped && maps::MayChangeStructure(policy);
  if (policy == maps::Policy::kBounded) {
    permissions.bounds.emplace();  // empty: a bounded map without bounds accepts no keyframe
    if (bounds) permissions.bounds.emplace(bounds->min, bounds->max);
  }
  // The map that a joined one ends in would not get what was left out.
  permissions.join = policy == maps::Policy::kOpen && !content_left_out;
  // A map that was saved or that has content is kept in any case.
  permissions.discard = !saved_snapshot && scene->entities.empty();
  return permissions;
}

std::shared_ptr<const engine::LightEstimate> LightOn(const engine::MapSnapshot& map,
                                                     const engine::MapMesh& mesh) {
  const auto light = engine::EstimateLight(map, mesh.mesh);
  return light ? std::make_shared<const engine::LightEstimate>(*light) : nullptr;
}

}  // namespace docent::app

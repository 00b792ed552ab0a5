// SPDX-License-Identifier: Apache-2.0
#include "content/scene.h"

#include <algorithm>

namespace docent::content {

Eigen::Vector3d PlaceOf(const Entity& entity) {
  return entity.kind == Entity::Kind::kModel ? entity.model.map_from_model.translation
                                             : entity.signpost.anchor;
}

void MoveWithAnchor(const engine::Sim3& motion, Entity* entity) {
  if (entity->kind == Entity::Kind::kModel) {
    entity->model.map_from_model = motion * entity->model.map_from_model;
  } else {
    entity->signpost.anchor = motion * entity->signpost.anchor;
    entity->signpost.up = motion.rotation * entity->signpost.up;
    entity->signpost.height_m *= motion.scale;
  }
}

const Entity* Scene::Find(const std::string& name) const {
  const auto found = std::find_if(entities.begin(), entities.end(),
                                  [&](const Entity& entity) { return entity.name == name; });
  return found == entities.end() ? nullptr : &*found;
}

std::string Scene::FreeName(const std::string& base) const {
  if (Find(base) == nullptr) return base;
  for (int number = 2;; ++number) {
    const std::string name = base + "-" + std::to_string(number);
    if (Find(name) == nullptr) return name;
  }
}

}  // namespace docent::content

// SPDX-License-Identifier: Apache-2.0
#include "app/session/session_map.h"

#include <algorithm>
#include <utility>

namespace docent::app {

void SessionMap::Grow(std::shared_ptr<const engine::MapSnapshot> grown) {
  const auto before = std::exchange(snapshot, std::move(grown));
  if (!before || !snapshot || scene->entities.empty()) return;
  const ContentFollower::Motions motions = follower.Follow(*scene, *before, *snapshot);
  if (motions.empty()) return;
  auto moved = std::make_shared<content::Scene>(*scene);
  for (const auto& [entity_name, motion] : motions) {
    const auto entity =
        std::find_if(moved->entities.begin(), moved->entities.end(),
                     [&wanted = entity_name](const content::Entity& e) { return e.name == wanted; });
    content::MoveAlong(motion, &*entity);
    history.MoveAlong(entity_name, motion);
  }
  scene = std::move(moved);
}

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#include "app/session/session_map.h"

#include <utility>

namespace docent::app {

void SessionMap::UpdateSnapshot(std::shared_ptr<const engine::MapSnapshot> newer) {
  const auto before = std::exchange(snapshot, std::move(newer));
  if (!before || !snapshot || scene->entities.empty()) return;
  const ContentFollower::Motions motions = follower.Follow(*scene, *before, *snapshot);
  if (motions.empty()) return;
  scene = Moved(*scene, motions);
  for (const auto& [entity, motion] : motions) history.MoveWithAnchor(entity, motion);
}

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "maps/hub/map_facts.h"
#include "maps/hub/sync.h"
#include "maps/hub/sync_state.h"

namespace docent::maps {

// The text of the scene among these items; empty if it is not.
std::string SceneOf(const ItemBytes& items);

// Two changes of one map as one.
struct Resolution {
  // The keyframes and points were changed on both sides, or the scene cannot be merged: both versions are
  // kept as two maps, and the rest here has no meaning.
  bool needs_two_maps = false;
  LocalMap map;                        // Its items may lack bytes that only the hub has.
  std::vector<std::string> conflicts;  // As MergedScene::conflicts.
};

// Merges the change of a map here with the one on the hub, of which `their_scene` is the scene, since `base`.
// Keyframes and points come from the side that changed them, the scene is merged by entity, and of names and
// policies that both sides changed the hub's counts. Pure but for `merge`.
Resolution Resolve(const MapLink& base, const LocalMap& mine, const HubRevision& theirs,
                   const std::string& their_scene, const MergeScenes& merge);

}  // namespace docent::maps

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "content/scene.h"

// Merges what two authors have changed in one scene, entity by entity. Entities are the same if they have the
// same name. Pure.
namespace docent::content {

// A merged scene.
struct SceneMerge {
  Scene scene;
  // One sentence for each entity, or the settings, that both have changed.
  std::vector<std::string> conflicts;
};

// Both scenes were made from `base`. An entity that one side changed or removed is as on that side; one that
// one side changed and the other removed stays, changed; of one that both changed differently, theirs keeps
// the name, and mine stays beside it under a new name. Of settings that both changed, theirs count, and the
// sentence says what mine were. Theirs come first, in their order. A new group of mine that has the name of
// a group of theirs gets another one, unless both sides have put the same entity into it.
SceneMerge MergeScenes(const Scene& base, const Scene& mine, const Scene& theirs);

}  // namespace docent::content

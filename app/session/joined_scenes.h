// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <set>
#include <string>

#include "app/session/library_scene.h"
#include "engine/mapping/loops/map_joining.h"
#include "maps/maintenance/joining.h"

// What happens to the content of two maps that are joined (maps/maintenance/joining.h). Pure functions; any
// thread.
namespace docent::app {

// Adds the entities of map B to `scene`, the scene of map A in the joined map; each entity stays with its
// anchor. Duplicate names, also of groups, get a number, and so do those in `taken`: the history of map A may
// restore entities with these names. A signpost that led from one of the two maps to the other leads nowhere.
void MergeScene(const content::Scene& b, const maps::MapInfo& map_a, const maps::MapInfo& map_b,
                const engine::JoinedMap& joined, const std::set<std::string>& taken, content::Scene* scene);

// The content of both maps, in the coordinates of the joined one.
content::Scene JoinScenes(const content::Scene& a, const content::Scene& b, const maps::MapInfo& map_a,
                          const maps::MapInfo& map_b, const engine::JoinedMap& joined);

// Redirects signposts that lead to the map `from` to the map `into`; returns false when there were none. Of
// both maps, only the key and the name matter, here and above.
bool RedirectSceneSignposts(const maps::MapInfo& from, const maps::MapInfo& into, content::Scene* scene);

// JoinScenes, as a library uses it. file: the library's, for error messages.
maps::SceneJoiner LibrarySceneJoiner(const std::string& file);

}  // namespace docent::app

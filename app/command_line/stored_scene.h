// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>

#include "content/edit_history.h"
#include "maps/library/library.h"

// Reads and changes the content of maps in a library, for command line tools. Throws Error, which names the
// library and the map.
namespace docent::app {

// "museum.docent, map 'Desk 3'".
std::string WhereStored(const maps::Library& library, const maps::MapInfo& map);

// The stored scene with the ids and names of its assets only, because listing and removing need no meshes.
content::Scene StoredNames(const maps::Library& library, const maps::MapInfo& map);

// Makes the change of a scene; see content/edits.h.
using MakeEdit = std::function<content::SceneChange(const content::Scene&)>;

// Whether the edits need the models of the scene, not only their names: those that keep the base of a model
// in place or need its size.
enum class ModelsNeeded { kNo, kYes };

// Applies edits to the stored scene of a map, one after the other, and saves it once. `added` is the asset of
// a model that they add, else null. Nothing changes when an edit does not fit, or the policy of the map
// forbids it.
void EditStoredScene(maps::Library* library, const maps::MapInfo& map, std::span<const MakeEdit> edits,
                     ModelsNeeded needed, const std::shared_ptr<const content::Asset>& added = nullptr);

}  // namespace docent::app

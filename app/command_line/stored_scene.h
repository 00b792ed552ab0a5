// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <span>
#include <string>

#include "content/edit_history.h"
#include "maps/library/library.h"

// Reads and changes the content of maps in a library, for command line tools. Throws Error, which names the
// library and the map. Damaged content is left out with a warning on standard error.
namespace docent::app {

// "museum.docent, map 'Desk 3'".
std::string WhereStored(const maps::Library& library, const maps::MapInfo& map);

// The stored scene with the ids and names of its assets only, because listing needs no meshes.
content::Scene StoredNames(const maps::Library& library, const maps::MapInfo& map);

// Makes the change of a scene; see content/edits.h.
using MakeEdit = std::function<content::SceneChange(const content::Scene&)>;

// Applies edits to the stored scene of a map, one after the other, and saves it once. Together they are one
// change, which a session can undo, as it can undo those before. Nothing changes when an edit does not fit,
// the policy of the map forbids it, or another program has changed the map since `map` was read, so that its
// work is kept. If content is damaged, only this change can be undone.
void EditStoredScene(maps::Library* library, const maps::MapInfo& map, std::span<const MakeEdit> edits);

}  // namespace docent::app

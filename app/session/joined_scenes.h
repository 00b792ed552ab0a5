// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "app/session/library_scene.h"
#include "engine/mapping/map_joining.h"
#include "maps/joining.h"

// What becomes of the content of maps when two of them become one (maps/joining.h). Pure functions; any
// thread.
namespace docent::app {

// Adds what stands in B to `scene`, which is that of A in the joined map: each thing among the points that it
// was placed among. Names that are taken get a number. A signpost that pointed from one of the two to the
// other points nowhere.
void TakeInScene(const content::Scene& b, const std::string& name_of_a, const std::string& name_of_b,
                 const engine::JoinedMap& joined, content::Scene* scene);

// What stands in both maps, in the coordinates of the joined one.
content::Scene JoinScenes(const content::Scene& a, const content::Scene& b, const std::string& name_of_a,
                          const std::string& name_of_b, const engine::JoinedMap& joined);

// Lets signposts to the map `from` point to `into` instead; false when there is none.
bool RedirectSignpostsIn(const std::string& from, const std::string& into, content::Scene* scene);

// The text of a scene whose signposts to the map `from` point to `into` instead; empty when it has none.
// Throws docent::Error when the text does not hold.
std::optional<std::string> RedirectSignposts(const std::string& text, const std::string& from,
                                             const std::string& into);

// Both, as a library takes them. file: of the library, for sentences.
maps::SceneJoiner LibrarySceneJoiner(const std::string& file);

}  // namespace docent::app

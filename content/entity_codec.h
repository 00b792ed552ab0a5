// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "content/gltf/json.h"
#include "content/scene.h"

// One entity as a JSON object, the part that stored scenes (scene_codec.h) and stored histories of edits
// (history_codec.h) have in common. Pure functions; thread-safe.
namespace docent::content {

// The version of scenes and histories that is written. Version 1 of a scene had no locked, hidden and group,
// and no to_key of a signpost; version 2 had no translations, and models and signposts only; version 3 had no
// direction of a signpost; version 4 had no entrances, and version 5 no occluders.
inline constexpr int kSceneVersion = 6;

// Returns the asset with an id, or nullptr when there is none.
using AssetLookup = std::function<std::shared_ptr<const Asset>(const std::string& id)>;

// The entity must be valid (Validate in scene.h).
Json EntityToJson(const Entity& entity);

// Throws Error, which begins with `where` and `place` ("entities[3]"), for whatever EntityToJson of this
// version does not write: unknown kinds and members, missing members, numbers out of range, an unknown asset,
// an empty name.
Entity EntityFromJson(std::string_view where, const std::string& place, const Json& json, int version,
                      const AssetLookup& find_asset);

// Throws Error when the object has a member that is not named here, or is no object.
void CheckMembers(std::string_view where, std::string_view place, const Json& object,
                  std::initializer_list<std::string_view> members);

}  // namespace docent::content

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "content/scene.h"

// Encodes a scene as JSON text, the form in which a library stores it (assets are stored separately, once
// each, by id):
//
//   {"docent_scene": 1, "assets": [ID…], "entities": [
//     {"kind": "model", "name": NAME, "asset": ID, "animation": N,
//      "map_from_model": {"rotation_xyzw": [x, y, z, w], "translation_m": [x, y, z], "scale": S}},
//     {"kind": "signpost", "name": NAME, "text": TEXT, "anchor_m": [x, y, z], "up": [x, y, z],
//      "height_m": H, "to_map": NAME}]}
//
// Numbers are written so that they read back to the same bits (rotations are normalized again).
namespace docent::content {

// DecodeScene reads what this returns. Throws Error for a scene that cannot be stored (Validate in scene.h).
std::string EncodeScene(const Scene& scene);

// Returns the ids in "assets", so that a library can fetch them first. Throws Error like DecodeScene.
std::vector<std::string> SceneAssetIds(std::string_view text);

// Returns the asset with an id, or nullptr when there is none.
using AssetLookup = std::function<std::shared_ptr<const Asset>(const std::string& id)>;

// Parses strictly: unknown versions, kinds and members, missing members, numbers out of range, duplicate
// names and unknown assets throw Error. `where` names the text in messages ("library.docent, map Desk").
Scene DecodeScene(std::string_view text, std::string_view where, const AssetLookup& find_asset);

}  // namespace docent::content

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "content/entity_codec.h"
#include "content/scene.h"

// Encodes a scene as JSON text, the form in which a library stores it (assets are stored separately, once
// each, by id):
//
//   {"docent_scene": 6, "assets": [ID…], "entities": [
//     {"kind": "model", "name": NAME, "locked": false, "hidden": false, "group": NAME,
//      "asset": ID, "animation": N,
//      "map_from_model": {"rotation_xyzw": [x, y, z, w], "translation_m": [x, y, z], "scale": S},
//      and, if it is bent (warp.h; the affine part by rows),
//      "warp": {"controls_m": [[x, y, z]…], "weights": [[x, y, z]…], "affine": [12 numbers]}},
//     {"kind": "signpost", "name": NAME, "locked": false, "hidden": false, "group": NAME,
//      "text": TEXT, "anchor_m": [x, y, z], "up": [x, y, z],
//      "height_m": H, "to_map": NAME, "to_key": KEY,
//      and, if there are any, "translations": {LANGUAGE: TEXT…} and "direction": [x, y, z]},
//     {"kind": "label", …, "text": TEXT, "anchor_m": [x, y, z], "offset_m": [x, y, z], "up": [x, y, z],
//      "text_height_m": H, and translations as a signpost},
//     {"kind": "image", …, "asset": ID, "map_from_image": as map_from_model},
//     {"kind": "sound", …, "asset": ID, "caption": TEXT, "position_m": [x, y, z], "range_m": R,
//      and translations of the caption},
//     {"kind": "trail", …, "points_m": [[x, y, z]…], "up": [x, y, z], "width_m": W},
//     {"kind": "occluder", …, "shape": "plane", "box" or "cylinder", "size": [width, height, depth],
//      "map_from_shape": as map_from_model},
//     {"kind": "occluder", …, "shape": "polygon", "outline": [[x, y]…], "map_from_shape": as above}]}
//
// where … stands for name, locked, hidden and group. Lengths are in map units; their suffix _m is kept,
// because libraries that exist have it.
//
// Numbers are written so that they read back to the same bits (rotations are normalized again). Version 1,
// without locked, hidden, group and to_key, version 2, without translations and the kinds after signposts,
// version 3, without directions, version 4, without entrances, and version 5, without occluders, are read as
// well.
namespace docent::content {

// DecodeScene reads what this returns. Throws Error for a scene that cannot be stored (Validate in scene.h).
std::string EncodeScene(const Scene& scene);

// Returns the ids in "assets", so that a library can fetch them first. Throws Error like DecodeScene.
std::vector<std::string> SceneAssetIds(std::string_view text);

// Parses strictly: unknown versions, kinds and members, missing members, numbers out of range, duplicate
// names and unknown assets throw Error. `where` names the text in messages ("library.docent, map Desk").
Scene DecodeScene(std::string_view text, std::string_view where, const AssetLookup& find_asset);

// Reads what can be read of a damaged scene: an entity that DecodeScene would refuse is left out, and an
// entity with the name of an earlier one gets a new name; both are named in `problems`, one sentence each.
// Throws Error only when the text is no scene at all, or was written by a newer version.
Scene ReadScene(std::string_view text, std::string_view where, const AssetLookup& find_asset,
                std::vector<std::string>* problems);

}  // namespace docent::content

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>

#include "content/scene.h"
#include "maps/storage/map_record.h"

// Converts between a scene and the record that a library stores of it. An asset that is placed in several
// maps is decoded once and shared.
namespace docent::app {

using AssetCache = std::map<std::string, std::shared_ptr<const content::Asset>>;  // by id

// `where` names the library and the map in error messages. Throws Error when stored data is invalid.
content::Scene SceneFromRecord(const maps::SceneRecord& record, const std::string& where, AssetCache* assets);

// The bytes of the assets are shared with the scene, not copied.
maps::SceneRecord RecordFromScene(const content::Scene& scene);

}  // namespace docent::app

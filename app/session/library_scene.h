// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <string>

#include "content/scene.h"
#include "maps/map_record.h"

// Between the scene of the content floor and the record that a library keeps of it. An asset that stands in
// several maps is decoded once and shared.
namespace docent::app {

using AssetCache = std::map<std::string, std::shared_ptr<const content::Asset>>;  // by id

// `where` names library and map in sentences. Throws Error when anything stored does not hold.
content::Scene SceneFromRecord(const maps::SceneRecord& record, const std::string& where, AssetCache* assets);

// The assets' bytes are shared with the scene, not copied.
maps::SceneRecord RecordFromScene(const content::Scene& scene);

}  // namespace docent::app

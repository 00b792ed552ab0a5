// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "content/edit_history.h"
#include "content/scene.h"
#include "maps/hub/sync.h"
#include "maps/library/library.h"
#include "maps/storage/map_record.h"
#include "maps/storage/scene_tools.h"

// Converts between a scene and the record that a library stores of it. An asset that is placed in several
// maps is decoded once and shared.
namespace docent::app {

using AssetCache = std::map<std::string, std::shared_ptr<const content::Asset>>;  // by id

// `where` names the library and the map in error messages. Throws Error when stored data is invalid.
content::Scene SceneFromRecord(const maps::SceneRecord& record, const std::string& where, AssetCache* assets);
// The same without what is damaged; `problems` gets a sentence for each entity and asset that is left out.
// Throws nothing that is not out of memory.
content::Scene ReadableScene(const maps::SceneRecord& record, const std::string& where, AssetCache* assets,
                             std::vector<std::string>* problems);

// The bytes of the assets are shared with the scene, not copied.
maps::SceneRecord RecordFromScene(const content::Scene& scene);

// The changes that can be undone, as a library stores them beside `scene`: the newest ones within the limits
// in map_record.h.
maps::SceneRecord RecordFromHistory(const content::EditHistory& history, const content::Scene& scene);
// Throws Error when the record is invalid. Changes that need an asset that is damaged are left out.
content::EditHistory HistoryFromRecord(const maps::SceneRecord& record, const std::string& where,
                                       AssetCache* assets);

// What a library needs to check scenes and to redirect their signposts.
maps::SceneTools LibrarySceneTools();
// What a hub needs to merge scenes that two people have changed.
maps::MergeScenes LibrarySceneMerger();
// What exchanges a library with the hub at this address by these functions.
maps::SyncOptions SyncOptionsOf(const std::string& hub, const std::filesystem::path& library);
// Opens a library with these functions; throws as maps::Library::Open does.
maps::Library OpenLibrary(const std::filesystem::path& path, maps::Access access,
                          maps::CreateIfMissing create = maps::CreateIfMissing::kNo);

}  // namespace docent::app

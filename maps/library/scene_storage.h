// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "maps/storage/database.h"
#include "maps/storage/map_record.h"

// Reads and writes the content of a map: its scene, and the changes of the scene that can be undone, both
// with their assets. The functions run in a transaction of the caller, and throw docent::Error.
namespace docent::maps {

SceneRecord ReadScene(const Database& database, std::uint64_t key);
// The same without what is damaged; `problems` gets a sentence for each asset, or the scene, that is left
// out.
SceneRecord ReadUndamagedScene(const Database& database, std::uint64_t key,
                               std::vector<std::string>* problems);
// The checksum of the text of the scene, which is empty if it is damaged, as in ReadUndamagedScene.
std::uint64_t ReadableSceneChecksum(const Database& database, std::uint64_t key);
void WriteScene(const Database& database, std::uint64_t key, const SceneRecord& scene);
// Replaces the text only. An undo history of the scene still fits, as no entity was added, moved or removed.
void WriteSceneText(const Database& database, std::uint64_t key, const std::string& text);
// Stores a scene if it differs from the stored one, and returns whether it does. Throws if the policy of the
// map forbids it.
bool UpdateScene(const Database& database, const SceneRecord& scene, const MapInfo& info);

// Empty if there is no history of the scene as it is.
std::optional<SceneRecord> ReadSceneHistory(const Database& database, std::uint64_t key);
// Throws if assets that the scene does not use are larger than kMaxHistoryAssetBytes together.
void WriteSceneHistory(const Database& database, std::uint64_t key, const SceneRecord& history);
// The text of the history of the scene as it is; empty if there is none, or a damaged one.
std::optional<std::string> FindHistoryText(const Database& database, std::uint64_t key);
// Replaces the text of the stored history only; an empty one removes the history.
void WriteHistoryText(const Database& database, std::uint64_t key, const std::string& text);
// As UpdateScene; a history with an empty text removes the stored one.
bool UpdateSceneHistory(const Database& database, const SceneRecord& history, const MapInfo& info);

}  // namespace docent::maps

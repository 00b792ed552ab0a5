// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "engine/map/map_snapshot.h"
#include "maps/storage/database.h"
#include "maps/storage/map_codec.h"
#include "maps/storage/map_record.h"

// Reads and writes the rows of each table, inside a transaction of the caller. Readers check the row's
// checksum and every value, and throw docent::Error with a message that begins with the file's name.
namespace docent::maps {

// The only row of the table `library`.
struct LibraryRow {
  std::uint64_t next_key = 1;  // Each key is used only once.
  std::uint64_t map_count = 0;
};
LibraryRow ReadLibraryRow(const Database& database);
void WriteLibraryRow(const Database& database, const LibraryRow& row);

// By ascending key.
std::vector<MapInfo> ReadMapRows(const Database& database);
std::optional<MapInfo> ReadMapRow(const Database& database, std::uint64_t key);
void WriteMapRow(const Database& database, const MapInfo& info);
std::optional<std::uint64_t> FindMapByName(const Database& database, const std::string& name);

// Returns the bytes of one binary column of a map; throws if it is missing.
Bytes ReadPart(const Database& database, std::uint64_t key, std::string_view part);
// Returns the cameras of a map; throws when images of their sizes could not be stored in a file of this size.
CameraTable ReadCameras(const Database& database, std::uint64_t key);
// Reads keyframes, points and observations without images; checks their counts against `info`.
MapParts ReadParts(const Database& database, const MapInfo& info);
void WriteParts(const Database& database, std::uint64_t key, const MapParts& parts);
// Writes the part `panoramas`, which WriteParts includes, when a map without it is upgraded.
void WritePanoramas(const Database& database, std::uint64_t key, const MapParts& parts);
// Passes the bytes of each keyframe's image to `take`, in the order of the keyframes; throws if one is
// missing.
using TakeImage = std::function<void(std::size_t keyframe_index, std::span<const std::uint8_t> bytes)>;
void ReadImages(const Database& database, std::uint64_t key, const std::vector<StoredKeyFrame>& keyframes,
                const TakeImage& take);
// Updates the stored images to those of `snapshot`; rows whose image is unchanged are not rewritten.
void WriteImages(const Database& database, std::uint64_t key, const engine::MapSnapshot& snapshot,
                 const std::vector<StoredKeyFrame>& keyframes,
                 const std::vector<StoredKeyFrame>& stored_before);

ScenePart ReadScenePart(const Database& database, std::uint64_t key);
void WriteScenePart(const Database& database, std::uint64_t key, const ScenePart& scene);

AssetRecord ReadAsset(const Database& database, const std::string& id);
// Stores an asset; if its id exists, checks that the stored asset is the same.
void WriteAsset(const Database& database, const AssetRecord& asset);
// Removes assets that no scene refers to.
void RemoveUnusedAssets(const Database& database);

void RemoveMapRows(const Database& database, std::uint64_t key);

// Runs `body` and prefixes the message of what it throws with "FILE: map 'Desk' (3): ".
void WithMapContext(const Database& database, const MapInfo& info, const std::function<void()>& body);

}  // namespace docent::maps

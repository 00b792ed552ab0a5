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
#include "maps/database.h"
#include "maps/map_codec.h"
#include "maps/map_record.h"

// Reading and writing the rows of each table, inside a transaction that the caller holds. Readers check the
// row's checksum and every value, and throw docent::Error with a sentence that begins with the file's name.
namespace docent::maps {

// The one row of the table `library`.
struct LibraryRow {
  std::uint64_t next_key = 1;  // keys are given out once
  std::uint64_t map_count = 0;
};
LibraryRow ReadLibraryRow(const Database& database);
void WriteLibraryRow(const Database& database, const LibraryRow& row);

// By ascending key.
std::vector<MapInfo> ReadMapRows(const Database& database);
std::optional<MapInfo> ReadMapRow(const Database& database, std::uint64_t key);
void WriteMapRow(const Database& database, const MapInfo& info);
std::optional<std::uint64_t> FindMapByName(const Database& database, const std::string& name);

// The bytes of one binary column of a map; throws when it is not there.
Bytes ReadPart(const Database& database, std::uint64_t key, std::string_view part);
// The cameras of a map; throws when one's images could not be in this file.
CameraTable ReadCameras(const Database& database, std::uint64_t key);
// Keyframes, points and observations without images; the counts agree with `info`.
MapParts ReadParts(const Database& database, const MapInfo& info);
void WriteParts(const Database& database, std::uint64_t key, const MapParts& parts);
// The part that WriteParts writes as well: for upgrading a map that has none.
void WritePanoramas(const Database& database, std::uint64_t key, const MapParts& parts);
// Hands the bytes of each keyframe's image to `take`, in the keyframes' order; every keyframe has one.
using TakeImage = std::function<void(std::size_t keyframe_index, std::span<const std::uint8_t> bytes)>;
void ReadImages(const Database& database, std::uint64_t key, const std::vector<StoredKeyFrame>& keyframes,
                const TakeImage& take);
// Brings the stored images to those of `snapshot`: rows whose image is the same stay untouched.
void WriteImages(const Database& database, std::uint64_t key, const engine::MapSnapshot& snapshot,
                 const std::vector<StoredKeyFrame>& keyframes,
                 const std::vector<StoredKeyFrame>& stored_before);

ScenePart ReadScenePart(const Database& database, std::uint64_t key);
void WriteScenePart(const Database& database, std::uint64_t key, const ScenePart& scene);

AssetRecord ReadAsset(const Database& database, const std::string& id);
// Stores an asset, or checks that the one of its id is the same.
void WriteAsset(const Database& database, const AssetRecord& asset);
// Removes the assets that no scene refers to.
void RemoveUnusedAssets(const Database& database);

void RemoveMapRows(const Database& database, std::uint64_t key);

// "FILE: map 'Desk' (3): " before what `body` throws.
void WithPlace(const Database& database, const MapInfo& info, const std::function<void()>& body);

}  // namespace docent::maps

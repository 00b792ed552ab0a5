// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
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

// A row of the table `maps` as it is stored.
struct MapRowValues {
  std::int64_t key = 0;
  std::string name, policy;
  // created_ns, modified_ns, revision, next_keyframe, next_point, and the three counts.
  std::array<std::int64_t, 8> numbers{};
  std::optional<Bytes> bounds;
  std::int64_t checksum = 0;
};
// Checks the values and their checksum. Throws docent::Error whose message begins with "its" or "it".
MapInfo CheckedMap(const MapRowValues& values);

// By ascending key.
std::vector<MapInfo> ReadMapRows(const Database& database);
std::optional<MapInfo> ReadMapRow(const Database& database, std::uint64_t key);
void WriteMapRow(const Database& database, const MapInfo& info);
std::optional<std::uint64_t> FindMapByName(const Database& database, const std::string& name);

// Returns the bytes of one binary column of a map; throws if it is missing.
Bytes ReadPart(const Database& database, std::uint64_t key, std::string_view part);
// The same; empty if it is missing.
std::optional<Bytes> FindPart(const Database& database, std::uint64_t key, std::string_view part);
void WritePart(const Database& database, std::uint64_t key, std::string_view part, const Bytes& bytes);
// The parts of which the checksums of blocks are stored beside them.
inline constexpr std::array<std::string_view, 3> kPartsInBlocks = {"keyframes", "points", "observations"};
// Returns the cameras of a map; throws when images of their sizes could not be stored in a file of this size.
CameraTable ReadCameras(const Database& database, std::uint64_t key);
// The same for the bytes of that column, in a file of this size.
CameraTable CheckedCameras(std::uint64_t key, std::span<const std::uint8_t> bytes, std::int64_t file_bytes);
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

// An asset from the values of its row; throws when its checksum does not match.
AssetRecord CheckedAsset(const std::string& id, const std::string& name, std::span<const std::uint8_t> bytes,
                         std::int64_t checksum);
AssetRecord ReadAsset(const Database& database, const std::string& id);
// Stores an asset; if its id exists, checks that the stored asset is the same.
void WriteAsset(const Database& database, const AssetRecord& asset);
// Removes assets that no scene and no undo history refers to.
void RemoveUnusedAssets(const Database& database);

void RemoveMapRows(const Database& database, std::uint64_t key);

// Runs `body` and prefixes the message of what it throws with "FILE: map 'Desk' (3): ".
void WithMapContext(const Database& database, const MapInfo& info, const std::function<void()>& body);

}  // namespace docent::maps

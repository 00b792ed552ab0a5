// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/dense/densification.h"
#include "engine/map/map_snapshot.h"
#include "maps/storage/byte_stream.h"
#include "maps/storage/lens_rows.h"
#include "maps/storage/policy.h"

// The values that are written to and read from a library. Large data is shared and immutable.
namespace docent::maps {

// Nanoseconds since 1970 (UTC).
using WallTime = std::chrono::sys_time<std::chrono::nanoseconds>;

// A file that a scene uses, which the library does not interpret. The id identifies the bytes: its creator
// uses a hash of them, so that an asset is stored once however many scenes use it.
struct AssetRecord {
  std::string id;    // 1 to 128 characters.
  std::string name;  // For display.
  std::shared_ptr<const Bytes>
      bytes;  // May be null in a save if the library already has an asset with this id.
};

// The content of a map: text that only the content library interprets, and the assets that it refers to.
struct SceneRecord {
  std::string text;                 // UTF-8.
  std::vector<AssetRecord> assets;  // Each once.
};

// Largest text of the undo history of a map.
inline constexpr std::size_t kMaxHistoryTextBytes = std::size_t{1} << 20;
// Largest size of the assets that nothing but the undo history of a map uses, together.
inline constexpr std::size_t kMaxHistoryAssetBytes = std::size_t{64} << 20;

// An entry of the list of maps, read without points or images.
struct MapInfo {
  std::uint64_t key = 0;                                      // Unique in the library, never reused.
  std::string name;                                           // Unique in the library.
  Policy policy = Policy::kOpen;                              // What may be changed.
  WallTime created{};                                         // Time of the first save.
  WallTime modified{};                                        // Last change of keyframes, points or content.
  std::uint64_t revision = 0;                                 // Of the stored snapshot.
  std::uint32_t next_keyframe = 0, next_point = 0;            // The next ids; see engine::MapSnapshot.
  std::uint64_t keyframes = 0, points = 0, observations = 0;  // The numbers of each.
  std::optional<Bounds> bounds;  // Of a map that is or was bounded; see policy.h.

  // Whether all fields are equal.
  bool operator==(const MapInfo& other) const = default;
};

// The input of one save.
struct MapRecord {
  std::uint64_t key = 0;  // From Library::NewKey or a loaded map.
  // Used only when the map is not in the library yet. Later they change only through Rename and SetPolicy, so
  // that a background save never reverts them.
  std::string name;
  Policy policy = Policy::kOpen;                        // See `name`.
  std::shared_ptr<const engine::MapSnapshot> snapshot;  // Null keeps the stored snapshot.
  std::shared_ptr<const SceneRecord> scene;             // Null keeps the stored scene.
  // For a new map that was bounded in another library. Without them, the bounds of a new bounded map are
  // computed from its contents.
  std::optional<Bounds> bounds = std::nullopt;
  // If set, the save only succeeds if the stored map has this revision, so that another program's work is not
  // overwritten.
  std::optional<std::uint64_t> expected_revision = std::nullopt;
  // Maps that were joined into this one. Those that are in the library are removed by this save.
  std::vector<std::uint64_t> joined_keys = {};
  // Current estimates of unknown lenses. They replace the library's estimates for the same cameras.
  std::vector<StoredLens> lenses = {};
  // The changes of the scene that can be undone. Null keeps the stored ones if the scene stays the same;
  // those of another scene are removed. An empty text removes them.
  std::shared_ptr<const SceneRecord> history = nullptr;
  // If set, the save only succeeds if the stored map still has this entry in the list of maps. A change of
  // its content by another program, which leaves the revision as it is, changes the time in the entry.
  std::optional<MapInfo> expected = std::nullopt;
  // If set, the save only succeeds if the text of the stored scene has this checksum (SceneTextChecksum), for
  // a caller that does not know the entry, because it saves the map itself meanwhile.
  std::optional<std::uint64_t> expected_scene = std::nullopt;
};

// The result of joining two maps (see joining.h).
struct JoinRecord {
  MapInfo into, from;                                   // As they were loaded. `from` is removed.
  std::shared_ptr<const engine::MapSnapshot> snapshot;  // The joined map.
  std::shared_ptr<const SceneRecord> scene;             // The joined scene.
  std::optional<Bounds> bounds;                         // Set if the stricter policy is bounded.
};

// A map as it was read.
struct StoredMap {
  MapInfo info;                                         // As in the list of maps.
  std::shared_ptr<const engine::MapSnapshot> snapshot;  // Never null.
  SceneRecord scene;                                    // All assets have their bytes.
  // The mesh of its surfaces; null if it has none, or a damaged one.
  std::shared_ptr<const engine::MapMesh> mesh = nullptr;
  // One sentence for each asset of the scene, or the scene itself, that is damaged and was left out.
  std::vector<std::string> lost_content = {};
};

}  // namespace docent::maps

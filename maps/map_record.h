// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/map/map_snapshot.h"
#include "maps/byte_stream.h"
#include "maps/policy.h"

// What goes into a library and what comes out of it. Plain values; large things are shared and never change.
namespace docent::maps {

// Nanoseconds since 1970 (UTC).
using WallTime = std::chrono::sys_time<std::chrono::nanoseconds>;

// A file that a scene shows, opaque to the library. The id names the bytes: whoever makes it uses a hash of
// them, so that one asset stands in the library once, however many scenes show it.
struct AssetRecord {
  std::string id;                      // 1 to 128 characters
  std::string name;                    // for people
  std::shared_ptr<const Bytes> bytes;  // may be null in a save when the library holds that id already
};

// What stands in a map: text that only the content floor understands, and the assets it refers to.
struct SceneRecord {
  std::string text;
  std::vector<AssetRecord> assets;
};

// One save.
struct MapRecord {
  std::uint64_t key = 0;  // from Library::NewKey or a loaded map
  // Used when the map is not in the library yet; later they change by Rename and SetPolicy alone, so that a
  // save on its way in the background never undoes them.
  std::string name;
  Policy policy = Policy::kOpen;
  std::shared_ptr<const engine::MapSnapshot> snapshot;  // null: the stored one stays
  std::shared_ptr<const SceneRecord> scene;             // null: the stored one stays
  // Of a new map that was bounded elsewhere; a new bounded map without them gets them from what it holds.
  std::optional<Bounds> bounds = std::nullopt;
  // When given, the map is only written over this revision: another program's work stays.
  std::optional<std::uint64_t> over_revision = std::nullopt;
  // Maps that were joined into this one: those of them that are in the library are removed by this save.
  std::vector<std::uint64_t> holds = {};
};

// What a list shows; read without touching points or images.
struct MapInfo {
  std::uint64_t key = 0;
  std::string name;
  Policy policy = Policy::kOpen;
  WallTime created{};
  WallTime modified{};  // of keyframes, points or content
  std::uint64_t revision = 0;
  std::uint32_t next_keyframe = 0, next_point = 0;
  std::uint64_t keyframes = 0, points = 0, observations = 0;  // counts
  std::optional<Bounds> bounds;                               // of a map that is or was bounded; see policy.h

  bool operator==(const MapInfo& other) const = default;
};

// Two maps that have become one (see joining.h).
struct JoinRecord {
  MapInfo into, from;  // as they were loaded: `into` takes over everything, `from` goes
  std::shared_ptr<const engine::MapSnapshot> snapshot;  // of both
  std::shared_ptr<const SceneRecord> scene;             // of both
  std::optional<Bounds> bounds;                         // where the stricter of the policies is bounded
  // The text of another map's scene once `from` is gone, given the text that it has; empty where it stays.
  std::function<std::optional<std::string>(const std::string& text)> redirect;
};

struct StoredMap {
  MapInfo info;
  std::shared_ptr<const engine::MapSnapshot> snapshot;  // never null
  SceneRecord scene;                                    // every asset has its bytes
};

}  // namespace docent::maps

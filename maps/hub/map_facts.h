// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "maps/storage/byte_stream.h"
#include "maps/storage/map_record.h"

// A map in the form in which a hub has it: facts, and items under their hashes. Items are the binary columns
// of a library with the key 1 instead of the library's own, so that equal maps of two devices are equal, and
// the text of the scene, in which signposts lead to maps by their number on the hub. Plain values.
namespace docent::maps {

// The key in the columns of every map on a hub.
inline constexpr std::uint64_t kHubKey = 1;

// What a map is besides its items; see MapInfo for the fields.
struct MapFacts {
  MapInfo info;                                    // The key counts only in a library.
  std::map<std::string, std::string> asset_names;  // By the id of the asset.
};

// The hash of each item: "keyframes", "image/7", "asset/ID".
using Manifest = std::map<std::string, std::string>;
// The bytes of items.
using ItemBytes = std::map<std::string, Bytes>;

// What tells a state of a map in a library from others.
struct LocalState {
  std::string stamp;       // LocalLibrary::StampOf.
  std::string scene_hash;  // Of the text of the scene as it is stored.
};

// A map as it is in a library, with all its bytes.
struct LocalMap {
  MapFacts facts;
  Manifest manifest;
  ItemBytes items;
  LocalState state;  // With which all this was read or written.
};

// A revision of a map on a hub.
struct HubRevision {
  std::int64_t revision = 0;  // From 1.
  bool removed = false;       // The map was removed with this revision.
  MapFacts facts;
  Manifest manifest;
};

// The newest revision of a map, as a list of maps has it.
struct HubHead {
  std::string id;             // A UUID in lower case.
  std::int64_t revision = 0;  // From 1.
  std::int64_t change = 0;    // Of the hub, with which it was saved.
  std::string name;           // Unique among the maps that were not removed.
  bool removed = false;
};

// Whether an item is the map itself: keyframes, points and images. Thumbnails, words and mesh are computed
// from them.
bool IsStructureItem(const std::string& item);
// Whether an item belongs to the content: the scene and its assets.
bool IsContentItem(const std::string& item);
// Whether a library has an item of this name.
bool IsItem(const std::string& item);
// Equal for maps with equal structure.
std::string StructureDigest(const MapFacts& facts, const Manifest& manifest);

// A new UUID (version 4, from the system's random numbers), and whether a text is one.
std::string NewMapId();
bool IsMapId(const std::string& text);
// The number under which signposts lead to the map: the first 63 bits of its id, which must be valid.
std::uint64_t NumberOf(const std::string& map_id);

// The same column for another key. Throws Error if it is damaged.
Bytes WithKey(const Bytes& column, std::uint64_t key);
// A column of a hub for a key of a library. Throws Error if it is damaged, or has not the key that all
// columns of a hub have: it would not be equal to what the hub gets back.
Bytes FromHub(const Bytes& column, std::uint64_t key);

}  // namespace docent::maps

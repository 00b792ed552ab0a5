// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/recognition/inverted_file.h"
#include "engine/recognition/place_index.h"
#include "engine/recognition/thumbnail_array.h"

// The data structures of the place index, shared by its two source files: place_index.cpp modifies them and
// place_index_search.cpp reads them. States are shared between threads and are immutable once published.
namespace docent::engine {

// The number of unused thumbnail slots, in addition to a sixteenth of all slots, above which an array is
// compacted.
inline constexpr std::size_t kDeadThumbnailsAllowed = 128;

// A keyframe of a map and the location of its thumbnail and words.
struct PlaceIndex::Entry {
  KeyFrameId keyframe = kNoId;
  std::uint32_t array = 0;       // Index in State::arrays.
  std::uint32_t slot = 0;        // Slot in that array.
  const void* source = nullptr;  // The features that it was computed from, while the map is in memory.
  KeyFrameId place = kNoId;
  bool described = false;                                // Its words were computed.
  InvertedFile::Slot word_slot = InvertedFile::kNoSlot;  // kNoSlot if it has no words.
};

struct PlaceIndex::Map {
  std::uint64_t key = 0;
  std::shared_ptr<const MapSnapshot> snapshot;  // Null while the map is not in memory.
  std::vector<Entry> entries;                   // By ascending keyframe.

  const Entry* Find(KeyFrameId keyframe) const {
    const auto entry = std::lower_bound(entries.begin(), entries.end(), keyframe,
                                        [](const Entry& e, KeyFrameId id) { return e.keyframe < id; });
    return entry != entries.end() && entry->keyframe == keyframe ? &*entry : nullptr;
  }
};

struct PlaceIndex::State {
  struct Array {
    std::shared_ptr<ThumbnailArray> thumbnails;  // Only the writer appends, beyond `size`.
    std::size_t size = 0;                        // The number of thumbnails in this state.
    std::size_t alive = 0;                       // The number of those that belong to a map.
  };
  std::vector<Array> arrays;                     // One for each thumbnail size.
  std::vector<std::shared_ptr<const Map>> maps;  // By ascending key.

  std::size_t LowerBound(std::uint64_t key) const {
    const auto place = std::lower_bound(maps.begin(), maps.end(), key,
                                        [](const auto& map, std::uint64_t k) { return map->key < k; });
    return static_cast<std::size_t>(place - maps.begin());
  }
  const Map* Find(std::uint64_t key) const {
    const std::size_t place = LowerBound(key);
    return place < maps.size() && maps[place]->key == key ? maps[place].get() : nullptr;
  }
  bool Holds(const Entry& entry, const PackedThumbnail& thumbnail) const {
    const ThumbnailArray& array = *arrays[entry.array].thumbnails;
    return array.shape().width == thumbnail.width && array.shape().height == thumbnail.height &&
           array.Holds(entry.slot, thumbnail);
  }
};

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "maps/inverted_file.h"
#include "maps/place_index.h"
#include "maps/thumbnail_array.h"

// What a place index is made of, for the two files that implement it: place_index.cpp changes it and
// place_index_search.cpp reads it. States are shared between threads and never change once they are
// published.
namespace docent::maps {

// Slots of thumbnails that went, beside a sixteenth of all.
inline constexpr std::size_t kDeadThumbnailsAllowed = 128;

// One keyframe of a map, and where its thumbnail lies.
struct PlaceIndex::Entry {
  engine::KeyFrameId keyframe = engine::kNoId;
  std::uint32_t array = 0;       // index in State::arrays
  std::uint32_t slot = 0;        // in that array
  const void* source = nullptr;  // the features it was made from, while the map holds them
  engine::KeyFrameId place = engine::kNoId;
  bool described = false;                                // its words are known
  InvertedFile::Slot word_slot = InvertedFile::kNoSlot;  // where they are; none: it has no words
};

struct PlaceIndex::Map {
  std::uint64_t key = 0;
  std::shared_ptr<const engine::MapSnapshot> snapshot;  // null while it is not in memory
  std::vector<Entry> entries;                           // by ascending keyframe

  const Entry* Find(engine::KeyFrameId keyframe) const {
    const auto entry =
        std::lower_bound(entries.begin(), entries.end(), keyframe,
                         [](const Entry& e, engine::KeyFrameId id) { return e.keyframe < id; });
    return entry != entries.end() && entry->keyframe == keyframe ? &*entry : nullptr;
  }
};

struct PlaceIndex::State {
  struct Array {
    std::shared_ptr<ThumbnailArray> thumbnails;  // changed by the writer alone, behind `size`
    std::size_t size = 0;                        // thumbnails that this state knows of
    std::size_t alive = 0;                       // of these, owned by a map still
  };
  std::vector<Array> arrays;                     // one a size of thumbnail
  std::vector<std::shared_ptr<const Map>> maps;  // by ascending key

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

}  // namespace docent::maps

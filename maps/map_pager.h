// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/recognition/place.h"
#include "maps/library.h"
#include "maps/place_index.h"

namespace docent::maps {

struct PagerOptions {
  std::size_t budget_bytes = std::size_t{1} << 30;  // of maps in memory
  // A library that is as small as this is read whole at the start: it is there before it is looked for.
  std::size_t read_at_start_bytes = std::size_t{256} << 20;
  // Who asks for a place waits for its map, so that equal images give equal answers on every run; else maps
  // are read on a thread of their own, and the answer has those that are there already.
  bool wait_for_maps = true;
};

// What a snapshot takes in memory, nearly: images, corners, points and observations.
std::size_t BytesOf(const engine::MapSnapshot& map);

// Keeps those maps of a library in memory that are used or likely to be, and lets the least recently used go
// when there are too many. All maps are in the place index from the start, by their thumbnails. It stands
// between a tracker and the index as the place finder: a map that a lost camera may be in is read, and is
// among the candidates once it is there; no candidate is without its map.
//
// What holds: maps that are held are never let go; beside them there are at most as many as the budget
// allows, and one more while it is read. Any thread may call anything. The callbacks come on the thread that
// reads; they may call Hold and Expect, and may wait for whoever calls these, but not for a Load.
class MapPager : public engine::PlaceFinder {
 public:
  struct Callbacks {
    // A map was read; it is in the index when this returns. May throw docent::Error: then it was not
    // readable.
    std::function<void(const StoredMap& map)> loaded;
    // Whether a map may go now (false: it has changes that are not on disk). After true it is forgotten here.
    std::function<bool(std::uint64_t key)> let_go;
    // A map could not be read, a sentence; it is not asked for again.
    std::function<void(std::uint64_t key, const std::string& problem)> failed;
  };

  // library and index must outlive the pager.
  MapPager(const Library* library, PlaceIndex* index, const PagerOptions& options, Callbacks callbacks);
  ~MapPager() override;

  // Fills the index, and reads maps as the options say. To be called once. Answers with what the library
  // lists.
  std::vector<MapInfo> Open();

  // Reads a map unless it is in memory, and waits for it. Throws docent::Error when it cannot be read.
  void Load(std::uint64_t key);
  // Maps that may be wanted soon, the likeliest first; they take the place of others that were not used for
  // longer. Does nothing when maps are waited for.
  void Expect(const std::vector<std::uint64_t>& keys);
  // These stay in memory until the next call.
  void Hold(const std::vector<std::uint64_t>& keys);

  std::vector<engine::PlaceCandidate> FindPlaces(const engine::PlaceQuery& query, int count, int per_map,
                                                 std::uint64_t only_map) const override;

  std::size_t bytes_in_memory() const;
  std::vector<std::uint64_t> maps_in_memory() const;  // the most recently used first

 private:
  class Impl;
  const std::unique_ptr<Impl> impl_;  // changes while places are looked for
};

}  // namespace docent::maps

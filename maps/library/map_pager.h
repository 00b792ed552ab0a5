// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/recognition/place.h"
#include "engine/recognition/place_index.h"
#include "maps/library/library.h"

namespace docent::maps {

// How much of a library is in memory at once.
struct PagerOptions {
  std::size_t budget_bytes = std::size_t{1} << 30;  // Limit for the maps in memory.
  // A library up to this size is loaded completely on opening, so that no map has to be read during
  // relocalization.
  std::size_t read_at_start_bytes = std::size_t{256} << 20;
  // If true, a place query waits until its maps are loaded, so that equal images give equal results in every
  // run. Otherwise a separate thread loads maps, and the result contains only those that are in memory.
  bool wait_for_maps = true;
  // How long a map that could not be read is not requested again; doubled each time up to the second one.
  std::chrono::milliseconds first_retry{30'000}, longest_retry{600'000};
  // Maps that are neither found by a lost camera nor loaded at the start.
  std::vector<std::uint64_t> left_out = {};
};

// The approximate memory of a snapshot: images, corners, points and observations.
std::size_t BytesOf(const engine::MapSnapshot& map);

// Keeps the maps of a library that are in use or likely to be used in memory, and evicts the least recently
// used ones when the budget is exceeded. All maps are in the place index from the start, by their appearance.
// As a PlaceFinder it sits between the tracker and the index: it loads the maps in which a lost camera may
// be, and returns a candidate only when its map is in memory.
//
// Guarantees: pinned maps are never evicted; the other maps fit the budget, except for one more while it is
// loaded. All functions are thread-safe. The callbacks run on the loading thread; they may call Pin and
// Prefetch and may wait for threads that call these, but must not wait for a Load.
class MapPager : public engine::PlaceFinder {
 public:
  // What the owner of the maps is told and asked.
  struct Callbacks {
    // Called when a map was read, before it is added to the index; damaged content was left out
    // (StoredMap::lost_content). May throw docent::Error to mark the map as
    // unreadable for now.
    std::function<void(const StoredMap& map)> loaded;
    // Asks whether the owner still has the map. Called after a map was added to the index, because it may
    // have been removed while it was read; it then leaves the index again.
    std::function<bool(std::uint64_t key)> exists;
    // Asks whether a map may be evicted now; return false if it has unsaved changes. After true the pager no
    // longer refers to it.
    std::function<bool(std::uint64_t key)> evict;
    // Called with a sentence when a map cannot be read, once as long as the sentence is the same. It is
    // requested again after PagerOptions::first_retry.
    std::function<void(std::uint64_t key, const std::string& problem)> failed;
  };

  // library and index must outlive the pager.
  MapPager(const Library* library, engine::PlaceIndex* index, const PagerOptions& options,
           Callbacks callbacks);
  ~MapPager() override;

  // Fills the index and loads maps according to the options. Call it once. Returns the library's list of
  // maps. Maps that cannot be read are reported to Callbacks::failed.
  std::vector<MapInfo> Open();

  // Loads a map unless it is in memory, and waits for it. Throws docent::Error when it cannot be read.
  void Load(std::uint64_t key);
  // Loads these maps in the background because they may be needed soon, the likeliest first; the least
  // recently used maps are evicted for them. Does nothing if PagerOptions::wait_for_maps is set.
  void Prefetch(const std::vector<std::uint64_t>& keys);
  // The library has another version of the map, which is requested also if the last one could not be read.
  void MapHasChanged(std::uint64_t key);
  // Keeps these maps in memory until the next call.
  void Pin(const std::vector<std::uint64_t>& keys);

  // See engine::PlaceFinder; only maps that are in memory.
  std::vector<engine::PlaceCandidate> FindPlaces(const engine::PlaceQuery& query, int count, int per_map,
                                                 std::uint64_t only_map) const override;

  std::size_t bytes_in_memory() const;                // Of all maps that are loaded; approximate.
  std::vector<std::uint64_t> maps_in_memory() const;  // The most recently used first.

 private:
  class Impl;
  const std::unique_ptr<Impl> impl_;  // FindPlaces is const but changes it.
};

}  // namespace docent::maps

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "engine/recognition/place.h"
#include "maps/thumbnail_array.h"

namespace docent::maps {

// Which keyframes, of all maps, look like a picture (ptamm §3.2, §3.3). A map is known by its thumbnails
// alone, so that all maps of a large library can be searched while only few of them are in memory; whoever
// loads or extends a map hands its newest snapshot to SetMap, whoever lets one go calls ReleaseMap. Any
// thread may call anything: a search reads one immutable state of the index, which writers replace whole and
// never wait for.
//
// What a keyframe costs: 1.3 kB for its thumbnail in two sizes and the numbers that go with it.
class PlaceIndex : public engine::PlaceFinder {
 public:
  PlaceIndex();
  ~PlaceIndex() override;

  // Adds a map or brings it up to date. Thumbnails of keyframes that the index has already are not stored
  // again. key > 0.
  void SetMap(std::uint64_t key, std::shared_ptr<const engine::MapSnapshot> map);
  // Adds a map that is not in memory: candidates in it have no snapshot. By ascending keyframe.
  void SetThumbnails(std::uint64_t key, std::span<const KeyFrameThumbnail> thumbnails);
  // Keeps a map's thumbnails and lets its snapshot go.
  void ReleaseMap(std::uint64_t key);
  void RemoveMap(std::uint64_t key);
  // Makes room for this many thumbnails of pictures with sides as 4 to 3, so that a library is read in one
  // go.
  void Reserve(std::size_t keyframes);

  std::size_t maps() const;
  std::size_t keyframes() const;

  // See ThumbnailArray::Hit for the difference. PlaceCandidate::map is null where the map is not in memory.
  // Thumbnails of another size than `image` are passed over.
  std::vector<engine::PlaceCandidate> FindPlaces(const engine::SmallBlurryImage& image, int count,
                                                 int per_map, std::uint64_t only_map) const override;

 private:
  struct Entry;
  struct Map;
  struct State;
  class Update;
  std::shared_ptr<const State> Current() const;
  void Publish(std::shared_ptr<const State> state);
  void Replace(std::uint64_t key, std::shared_ptr<const engine::MapSnapshot> snapshot,
               std::span<const KeyFrameThumbnail> thumbnails, std::span<const void* const> sources);

  std::mutex write_mutex_;              // one writer at a time
  mutable std::mutex state_mutex_;      // held while a pointer is copied
  std::shared_ptr<const State> state_;  // never null
};

}  // namespace docent::maps

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "engine/recognition/place.h"

namespace docent::maps {

// The thumbnails of all keyframes of all maps, side by side in memory, and an exhaustive search among them
// (ptamm §3.2, §3.3). Whoever loads or extends a map hands its newest snapshot to SetMap. Any thread may call
// anything: a search reads one immutable state of the index, which writers replace whole and never wait for.
class PlaceIndex : public engine::PlaceFinder {
 public:
  PlaceIndex();
  ~PlaceIndex() override;

  // Adds a map or brings it up to date. Thumbnails of keyframes that the index has already are not copied: a
  // snapshot with one more keyframe costs one thumbnail and two pointers for each keyframe. key > 0.
  void SetMap(std::uint64_t key, std::shared_ptr<const engine::MapSnapshot> map);
  void RemoveMap(std::uint64_t key);

  std::size_t maps() const;
  std::size_t keyframes() const;

  // Thumbnails of another size than `image` are passed over.
  std::vector<engine::PlaceCandidate> FindPlaces(const engine::SmallBlurryImage& image, int count,
                                                 int per_map, std::uint64_t only_map) const override;

 private:
  struct Map;
  struct State;
  std::shared_ptr<const State> Current() const;
  // Puts `map` in the place of the map of `key`; null only removes.
  void Replace(std::uint64_t key, std::shared_ptr<const Map> map);

  std::mutex write_mutex_;              // one writer at a time
  mutable std::mutex state_mutex_;      // held while a pointer is copied
  std::shared_ptr<const State> state_;  // never null
};

}  // namespace docent::maps

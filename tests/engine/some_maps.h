// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "engine/recognition/place.h"

namespace docent::engine::testing_world {

// A place finder over a few maps that compares the query with the thumbnail of every keyframe.
class SomeMaps : public PlaceFinder {
 public:
  void Add(std::uint64_t key, std::shared_ptr<const MapSnapshot> map) { maps_[key] = std::move(map); }
  const std::shared_ptr<const MapSnapshot>& At(std::uint64_t key) const { return maps_.at(key); }
  std::vector<PlaceCandidate> FindPlaces(const PlaceQuery& query, int count, int per_map,
                                         std::uint64_t only_map) const override {
    std::vector<PlaceCandidate> found;
    for (const auto& [key, map] : maps_) {
      if (only_map != 0 && only_map != key) continue;
      std::vector<PlaceCandidate> of_map;
      for (const KeyFrame& keyframe : map->keyframes)
        of_map.push_back({key, map, keyframe.id, Difference(keyframe.features->small_blurry, *query.image)});
      KeepMostSimilar(per_map, &of_map);
      found.insert(found.end(), of_map.begin(), of_map.end());
    }
    KeepMostSimilar(count, &found);
    return found;
  }

 private:
  static void KeepMostSimilar(int count, std::vector<PlaceCandidate>* found) {
    std::sort(found->begin(), found->end(),
              [](const auto& a, const auto& b) { return a.difference < b.difference; });
    found->resize(std::min(found->size(), static_cast<std::size_t>(count)));
  }

  std::map<std::uint64_t, std::shared_ptr<const MapSnapshot>> maps_;
};

}  // namespace docent::engine::testing_world

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/map/map_snapshot.h"

namespace docent::engine {

// A set of point ids of one map, stored as one bit per id. Insertion does not sort, nothing is allocated once
// the set has the size of the map, and iteration is by ascending id. Not thread safe.
class PointIdSet {
 public:
  // Empties the set. Ids below `end` may be inserted afterwards; Insert ignores others.
  void Clear(MapPointId end) { words_.assign((static_cast<std::size_t>(end) + kBits - 1) / kBits, 0); }
  void Insert(MapPointId id) {
    if (id / kBits < words_.size()) words_[id / kBits] |= std::uint64_t{1} << (id % kBits);
  }
  bool Contains(MapPointId id) const {
    return id / kBits < words_.size() && (words_[id / kBits] >> (id % kBits) & 1) != 0;
  }
  // Calls visit(MapPointId) by ascending id.
  template <typename Visit>
  void ForEach(Visit&& visit) const {
    for (std::size_t i = 0; i < words_.size(); ++i) {
      for (std::uint64_t word = words_[i]; word != 0; word &= word - 1)
        visit(static_cast<MapPointId>(i * kBits + static_cast<std::size_t>(std::countr_zero(word))));
    }
  }

 private:
  static constexpr std::size_t kBits = 64;
  std::vector<std::uint64_t> words_;
};

}  // namespace docent::engine

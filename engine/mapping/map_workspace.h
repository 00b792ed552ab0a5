// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "engine/map/map.h"
#include "engine/mapping/points/map_descriptors.h"
#include "engine/matching/point_search.h"
#include "engine/recognition/vocabulary_tree.h"

namespace docent::engine {

// The map that the mapper works on, with what its tasks derive from it. The mapper owns it, its tasks borrow
// it; on the thread that runs the mapper only.
struct MapWorkspace {
  explicit MapWorkspace(const SearchOptions& search) : searcher(search), descriptors(DefaultVocabulary()) {}

  // Continues with another map.
  void Reset(Map other) {
    map = std::move(other);
    searcher.Clear();
    descriptors.Clear();
  }
  // Time of the newest keyframe; the map must have one.
  Timestamp NewestTime() const { return map.keyframes().rbegin()->second.keyframe.time; }

  Map map;
  PointSearcher searcher;      // caches patches of the map's points
  MapDescriptors descriptors;  // of the map's points
};

}  // namespace docent::engine

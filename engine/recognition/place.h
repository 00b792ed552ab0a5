// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "engine/map/map_snapshot.h"
#include "engine/recognition/word_bag.h"
#include "engine/vision/small_blurry_image.h"

namespace docent::engine {

// A keyframe of one of the maps whose appearance resembles the present image. Not verified geometrically.
struct PlaceCandidate {
  std::uint64_t map_key = 0;               // the map that it belongs to
  std::shared_ptr<const MapSnapshot> map;  // null if the map is not in memory
  KeyFrameId keyframe = kNoId;             // of that map
  double difference = 0;                   // mean squared difference of the thumbnails
};

// The appearance of the image whose place is wanted. A view: the caller keeps both objects alive.
struct PlaceQuery {
  // Retrieval by thumbnail alone.
  PlaceQuery(const SmallBlurryImage& thumbnail)  // NOLINT(google-explicit-constructor)
      : image(&thumbnail) {}
  // Retrieval by thumbnail and visual words; an empty bag counts as none.
  PlaceQuery(const SmallBlurryImage& thumbnail, const WordBag& visual_words)
      : image(&thumbnail), words(&visual_words) {}

  const SmallBlurryImage* image;   // never null
  const WordBag* words = nullptr;  // null: none
  // If true, candidates of distinct places come first; otherwise the most similar keyframes of any place.
  bool places_first = true;
};

// Place recognition over all maps, implemented by the library's place index; trackers use it when they are
// lost. May be called from several threads at once.
class PlaceFinder {
 public:
  virtual ~PlaceFinder() = default;
  // The best `count` candidates, most similar first, at most `per_map` of one map. only_map: restricts the
  // search to that map unless it is 0 (ptamm §3.3). Returns an empty vector if there are no maps.
  virtual std::vector<PlaceCandidate> FindPlaces(const PlaceQuery& query, int count, int per_map,
                                                 std::uint64_t only_map) const = 0;
};

}  // namespace docent::engine

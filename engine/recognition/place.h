// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "engine/map/map_snapshot.h"
#include "engine/recognition/word_bag.h"
#include "engine/vision/small_blurry_image.h"

namespace docent::engine {

// A keyframe that looks like the present image, in one of the maps. Appearance only: nothing is verified.
struct PlaceCandidate {
  std::uint64_t map_key = 0;
  std::shared_ptr<const MapSnapshot> map;
  KeyFrameId keyframe = kNoId;
  double difference = 0;  // mean squared difference of the thumbnails
};

// What is known of the image whose place is sought. A view: whoever asks keeps both until the answer.
struct PlaceQuery {
  // By its thumbnail alone.
  PlaceQuery(const SmallBlurryImage& thumbnail)  // NOLINT(google-explicit-constructor)
      : image(&thumbnail) {}
  // By its words as well; empty ones are none.
  PlaceQuery(const SmallBlurryImage& thumbnail, const WordBag& visual_words)
      : image(&thumbnail), words(&visual_words) {}

  const SmallBlurryImage* image;
  const WordBag* words = nullptr;
  // Different places first; else the most alike keyframes, whatever place they are of.
  bool places_first = true;
};

// Whoever knows all maps (the library's place index) answers this; the engine asks it when it is lost.
// May be called from several threads at once.
class PlaceFinder {
 public:
  virtual ~PlaceFinder() = default;
  // The best `count` candidates, most alike first, at most `per_map` of one map. With only_map != 0 the
  // search stays in that map (ptamm §3.3). Never throws for lack of maps: the answer is empty.
  virtual std::vector<PlaceCandidate> FindPlaces(const PlaceQuery& query, int count, int per_map,
                                                 std::uint64_t only_map) const = 0;
};

}  // namespace docent::engine

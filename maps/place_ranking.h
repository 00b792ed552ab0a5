// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/map/map_snapshot.h"

// Of keyframes that were compared with an image in two ways, which are to be looked at first.
namespace docent::maps {

struct PlaceScore {
  std::uint64_t map_key = 0;
  engine::KeyFrameId place = engine::kNoId;  // of its map; keyframes of one place see nearly the same
  double difference = 0;                     // of the thumbnails, see ThumbnailArray::Hit
  double words = 0;                          // that are shared, see InvertedFile::Hit
};

// What keyframes of other places have in common with the image.
struct ChanceLevel {
  double correlation = 0;  // of thumbnails; less than 1
  double words = 0.1;      // more than 0
};

// How much alike two images are by both ways, larger is more alike: by how much the correlation of their
// thumbnails is more than chance, in parts of what there is above it, and by how much the words that are
// shared are, in parts of it. Each counts about 1 where it is sure, and about 0 where it knows nothing.
double Likeness(const PlaceScore& score, const ChanceLevel& chance);

// Indices of the best `count`, at most `per_map` of one map: first the best of each of the `places` best
// places, the most alike first; then the rest, the most alike first, whatever place it is of: a place is
// verified by whichever of its keyframes fits. Ties go to the earlier.
inline constexpr std::size_t kDifferentPlaces = 5;
std::vector<std::size_t> RankPlaces(std::span<const PlaceScore> scores, const ChanceLevel& chance,
                                    std::size_t count, std::size_t per_map,
                                    std::size_t places = kDifferentPlaces);

}  // namespace docent::maps

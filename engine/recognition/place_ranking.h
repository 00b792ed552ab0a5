// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/map/map_snapshot.h"

// Ranks keyframes that were compared with an image by thumbnail and by words.
namespace docent::engine {

struct PlaceScore {
  std::uint64_t map_key = 0;
  KeyFrameId place = kNoId;  // Within its map; keyframes of one place see nearly the same.
  double difference = 0;     // Of the thumbnails; see ThumbnailArray::Hit.
  double words = 0;          // Score of the shared words; see InvertedFile::Hit.
};

// The similarity that keyframes of other places have with the image by chance.
struct ChanceLevel {
  double correlation = 0;  // Of thumbnails; less than 1.
  double words = 0.1;      // Greater than 0.
};

// The similarity of two images by both methods; larger is more similar. It is the sum of the excess of the
// thumbnails' correlation over chance, relative to the largest possible excess, and of the excess of the word
// score over chance, relative to chance. Each term is about 1 for a certain match and 0 for one at chance
// level.
double PlaceSimilarity(const PlaceScore& score, const ChanceLevel& chance);

// Returns the indices of the best `count` keyframes, at most `per_map` of one map: first the best keyframe of
// each of the `places` best places, then the others regardless of their place, both by descending similarity.
// Several keyframes of one place are useful, because any of them may pass geometric verification. Ties go to
// the lower index.
inline constexpr std::size_t kDifferentPlaces = 5;
std::vector<std::size_t> RankPlaces(std::span<const PlaceScore> scores, const ChanceLevel& chance,
                                    std::size_t count, std::size_t per_map,
                                    std::size_t places = kDifferentPlaces);

}  // namespace docent::engine

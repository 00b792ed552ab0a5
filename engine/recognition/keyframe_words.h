// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "engine/map/map_snapshot.h"
#include "engine/recognition/word_bag.h"

// The visual words of a map's keyframes, and which keyframes show the same place. Pure functions; any thread.
namespace docent::engine {

struct KeyFrameWords {
  KeyFrameId keyframe = kNoId;
  KeyFrameId place = kNoId;  // The keyframe that represents its place; see PlacesOf.
  WordBag words;

  bool operator==(const KeyFrameWords& other) const = default;
};

// For each keyframe, in their order, the keyframe that represents its place: the first earlier representative
// that is close to it (within half of the smaller of their median depths and rotated by at most 35 degrees),
// or itself if there is none.
std::vector<KeyFrameId> PlacesOf(const MapSnapshot& map);

// Returns the words of a map's keyframes: those in `known` (may be empty; by ascending keyframe) are copied,
// the others are computed in some milliseconds each.
std::vector<KeyFrameWords> MakeWords(const MapSnapshot& map, std::span<const KeyFrameWords> known);

// Returns the words of an image; empty if it is too small.
WordBag WordsOf(const ImageFeatures& features);

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <opencv2/core.hpp>
#include <vector>

#include "engine/base/random.h"
#include "engine/recognition/place_index.h"

// Places for benchmarks of place recognition: the maps of the simulator's museum and desks, and replicas of
// them. The keyframes are from the walks on which each place is mapped, the queries from later visits on
// other paths.
namespace docent::bench {

// The appearance of an image.
struct View {
  engine::SmallBlurryImage thumbnail;
  engine::WordBag words;
};
// An image of a visit, and the map that it shows.
struct Visit {
  std::uint64_t map_key = 0;
  cv::Mat gray;
  View view;
};
struct Places {
  std::map<std::uint64_t, std::vector<View>> maps;  // by key
  std::vector<Visit> visits;
};

View ViewOf(const cv::Mat& gray);
// Every fourth frame of a mapping walk is a keyframe, and every eighth of a visit a query.
const Places& SimulatedPlaces();
// A replica of a view as another place: mirrored, and half of its content replaced.
engine::SmallBlurryImage Replica(const engine::SmallBlurryImage& image, bool mirrored, Random* random);
// Keeps half of the words and adds as many from other keyframes, common ones more often.
engine::WordBag Replica(const engine::WordBag& words, Random* random);

// Gets a map's key, and the appearance of its keyframes.
using GiveMap =
    std::function<void(std::uint64_t key, const std::vector<engine::KeyFrameThumbnail>& thumbnails,
                       const std::vector<engine::KeyFrameWords>& words)>;
// The simulated places with their own keys, and replicas of them with keys from 1000 on, each with this many
// keyframes.
void MakeMaps(std::size_t maps, std::size_t keyframes, const GiveMap& give);
// The same in an index.
void FillIndex(std::size_t maps, std::size_t keyframes, engine::PlaceIndex* index);

// Resident memory of the program.
double ResidentBytes();
// The rank of a map among the candidates; 1000 if it is not among them.
std::size_t RankOf(const std::vector<engine::PlaceCandidate>& candidates, std::uint64_t key);

}  // namespace docent::bench

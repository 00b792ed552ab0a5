// SPDX-License-Identifier: Apache-2.0
#include "engine/recognition/place_ranking.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "engine/recognition/thumbnail_array.h"

namespace docent::engine {

double PlaceSimilarity(const PlaceScore& score, const ChanceLevel& chance) {
  const double correlation = 1 - score.difference / (2 * kThumbnailContrast * kThumbnailContrast);
  return std::max(0.0, (correlation - chance.correlation) / (1 - chance.correlation)) +
         std::max(0.0, score.words / chance.words - 1);
}

std::vector<std::size_t> RankPlaces(std::span<const PlaceScore> scores, const ChanceLevel& chance,
                                    std::size_t count, std::size_t per_map, std::size_t places) {
  std::vector<double> likeness;
  for (const PlaceScore& score : scores) likeness.push_back(PlaceSimilarity(score, chance));
  std::vector<std::size_t> order(scores.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return likeness[a] > likeness[b]; });
  std::map<std::uint64_t, std::size_t> given;  // The number of results by map.
  std::set<std::pair<std::uint64_t, KeyFrameId>> seen;
  std::vector<std::size_t> ranked, later;
  const auto take = [&](std::size_t index) {
    if (ranked.size() == count || given[scores[index].map_key] == per_map) return;
    ++given[scores[index].map_key];
    ranked.push_back(index);
  };
  for (const std::size_t index : order) {
    const std::pair place(scores[index].map_key, scores[index].place);
    if (ranked.size() >= places || seen.contains(place)) {
      later.push_back(index);
    } else {
      seen.insert(place);
      take(index);
    }
  }
  for (const std::size_t index : later) take(index);
  return ranked;
}

}  // namespace docent::engine

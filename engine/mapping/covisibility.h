// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "engine/map/map.h"

namespace docent::engine {

// How many finite points each two localized keyframes share, as the map was when this was counted. For the
// mapper's thread.
class Covisibility {
 public:
  explicit Covisibility(const Map& map);

  // By ascending id.
  const std::vector<KeyFrameId>& keyframes() const { return keyframes_; }
  // keyframes().size() for one that is not among them.
  std::size_t IndexOf(KeyFrameId id) const;
  // Of two indices; 0 for a keyframe with itself.
  int Shared(std::size_t a, std::size_t b) const { return a == b ? 0 : counts_[a * keyframes_.size() + b]; }
  // Whether two share a good part of the points that one of them sees: some few are always seen in the wrong
  // place, and tell nothing of where the two are.
  bool AreNeighbours(std::size_t a, std::size_t b) const;
  // Metres from one keyframe to another by way of neighbours; infinite when there is no such way.
  double PathLengthBetween(KeyFrameId from, KeyFrameId to, const Map& map) const;

 private:
  std::vector<KeyFrameId> keyframes_;
  std::vector<int> counts_;  // row by row
};

}  // namespace docent::engine

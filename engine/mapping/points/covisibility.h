// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "engine/map/map.h"

namespace docent::engine {

// The number of finite points that each pair of localized keyframes shares, at the time of construction. For
// the mapper's thread.
class Covisibility {
 public:
  explicit Covisibility(const Map& map);

  // In ascending order of id.
  const std::vector<KeyFrameId>& keyframes() const { return keyframes_; }
  // Returns keyframes().size() if the keyframe is not in the list.
  std::size_t IndexOf(KeyFrameId id) const;
  // The number of shared points of two indices; 0 for a keyframe with itself.
  int Shared(std::size_t a, std::size_t b) const { return a == b ? 0 : counts_[a * keyframes_.size() + b]; }
  // True if the two share a considerable part of the points that one of them observes. A few shared points
  // are no evidence, since some points are always matched in the wrong place.
  bool AreNeighbours(std::size_t a, std::size_t b) const;
  // Length of the shortest path from one keyframe to the other through neighbours, in map units; infinite if
  // there is no such path.
  double PathLengthBetween(KeyFrameId from, KeyFrameId to, const Map& map) const;

 private:
  std::vector<KeyFrameId> keyframes_;
  std::vector<int> counts_;  // matrix in row-major order
};

}  // namespace docent::engine

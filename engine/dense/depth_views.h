// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/map/map_snapshot.h"

// Chooses the keyframes that dense depth is estimated from: which neighbours are compared with a keyframe,
// and between which distances its surfaces are searched. Both come from the map points. Pure functions.
namespace docent::engine {

struct DepthViewOptions {
  int max_neighbours = 4;  // More neighbours cost time and see the same surfaces.
  // Two keyframes are compared if they share at least this many finite points.
  int min_shared_points = 15;
  // The parallax at which depth is best: below it, depth is uncertain; above it, the images differ. The score
  // of a pair falls by exp(-1/2) when the parallax differs by these from the best one (as MVSNet, Yao et al.
  // 2018, but with a larger best angle, since keyframes of a hand-held camera are further apart).
  double best_parallax_deg = 7, less_parallax_deg = 3, more_parallax_deg = 10;
  int min_points = 20;  // Fewer visible points do not determine the range of distances.
  // The range ends this factor beyond the distances of 98 % of the points.
  double range_margin = 1.5;

  // Describes the first invalid option, or empty.
  std::optional<std::string> Validate() const;
};

// What the depth of one keyframe is estimated from.
struct DepthViews {
  KeyFrameId keyframe = kNoId;
  std::vector<KeyFrameId> neighbours;                         // The best one first; never empty.
  double min_inverse_distance = 0, max_inverse_distance = 0;  // 1 / map units; 0 < min < max.
};

// One entry for each localized keyframe of which the depth can be estimated, by ascending id.
std::vector<DepthViews> ChooseDepthViews(const MapSnapshot& map, const DepthViewOptions& options = {});

}  // namespace docent::engine

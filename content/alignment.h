// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "engine/geometry/sim3.h"

// Finds the pose of a model from points whose places in the map are known, for instance because a person
// pointed at them. Pure functions; thread-safe.
namespace docent::content {

inline constexpr std::size_t kMinAlignmentPoints = 3;

// A point of a model and where it is in the map.
struct Correspondence {
  Eigen::Vector3d in_model;  // Model axes, metres.
  Eigen::Vector3d in_map;    // Map units.
};

struct Alignment {
  engine::Sim3 map_from_model;
  std::vector<double> residuals;  // Of each correspondence: the distance in the map, map units.
  std::vector<bool> inliers;      // Those that the pose was estimated from.
};

// The similarity that fits the correspondences best. Of more than four, up to (count - 3) / 2 may be wrong:
// the pose of three of them with the smallest median-like residual of all is found (least quantile of
// squares, Rousseeuw 1984), and the similarity is then fitted to all that agree with it (Umeyama 1991).
// Throws Error with one sentence for fewer than three correspondences, points that coincide or lie on one
// line, numbers that are not finite, and points that fit no pose: half of the residuals exceed a quarter of
// their extent.
Alignment AlignModel(std::span<const Correspondence> correspondences);

}  // namespace docent::content

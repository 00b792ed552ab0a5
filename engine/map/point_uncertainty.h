// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "engine/map/map_snapshot.h"

// The uncertainty of a map's points. Computed on demand from the observations, because each adjustment
// changes the poses and with them the uncertainty of every point. Pure functions; any thread.
namespace docent::engine {

// For each point of the map, in order: the standard deviation of its position along the line of sight from
// its source keyframe, divided by its distance from there (0.01 is one per cent of the depth). Gaussian
// covariance of the position for fixed keyframe poses. pixel_sigma: standard deviation of a measurement in
// either image direction, in pixels of its level. Infinite for infinite points and for points with
// practically parallel rays.
std::vector<float> RelativeDepthDeviations(const MapSnapshot& map, double pixel_sigma = 0.5);

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "engine/map/map_snapshot.h"

// How well a map knows where its points are. Worked out on demand from the observations, as the poses and
// with them every point's uncertainty change with each adjustment. Pure functions; any thread.
namespace docent::engine {

// Of each point of the map, in its order: the standard deviation of its place along the line of sight from
// its source keyframe, over its distance from there (0.01: one per cent of the depth). By the Gaussian
// covariance of the place alone, the keyframes taken to stand where the map says, with pixel_sigma (pixels of
// the level that a measurement was made on) in either direction of the image. Infinite for what has no
// depth: infinite points, and points whose rays are as good as parallel.
std::vector<float> RelativeDepthDeviations(const MapSnapshot& map, double pixel_sigma = 0.5);

}  // namespace docent::engine

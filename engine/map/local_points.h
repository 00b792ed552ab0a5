// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "engine/geometry/sim3.h"
#include "engine/map/map_snapshot.h"

// How a part of a map moves when the map is adjusted. What stands in a map stands among points, and should
// stay among them: adjustments move, turn and stretch one part of a map otherwise than another.
namespace docent::engine {

// Finite points about a place, as they were at some time.
struct LocalPoints {
  std::vector<MapPointId> ids;             // ascending
  std::vector<Eigen::Vector3d> positions;  // in the map
};

// The `count` finite points nearest to the place, or all that there are.
LocalPoints PointsAbout(const MapSnapshot& map, const Eigen::Vector3d& place, std::size_t count);

// The similarity now_from_then that took these points to where `now` has them; those that went another way
// than most count for nothing. Empty when too few are left, or they stand on one line.
std::optional<Sim3> MotionOf(const LocalPoints& then, const MapSnapshot& now);

}  // namespace docent::engine

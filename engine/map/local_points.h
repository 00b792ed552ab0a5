// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "engine/geometry/sim3.h"
#include "engine/map/map_snapshot.h"

// Estimates how a part of a map moves in an adjustment. Placed models must keep their place relative to the
// map points around them, and an adjustment moves, rotates and scales one part of a map differently from
// another.
namespace docent::engine {

// Finite points near a position, with their coordinates at one time.
struct LocalPoints {
  std::vector<MapPointId> ids;             // ascending
  std::vector<Eigen::Vector3d> positions;  // in the map
};

// The `count` finite points nearest to a position, or all if there are fewer.
LocalPoints NearestPoints(const MapSnapshot& map, const Eigen::Vector3d& position, std::size_t count);

// The similarity now_from_before between the points' former and present positions, without points that moved
// differently from most. Empty if fewer than 12 of the points still exist or the points are collinear.
std::optional<Sim3> EstimateMotion(const LocalPoints& before, const MapSnapshot& now);

}  // namespace docent::engine

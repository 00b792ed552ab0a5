// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "engine/map/map_snapshot.h"

// Which way is up in a map, as its keyframes suggest. What is seen from above (the map view, plans, grids of
// places) uses this direction, and so does upright content unless an author has shown the floor
// (app/session/map_axes.h); docs/coordinates.md explains it. Pure functions; any thread.
namespace docent::engine {

// Right-handed axes of the map's horizontal plane and its normal; unit vectors in the map.
struct UprightAxes {
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();
  // The horizontal part of the first keyframe's viewing direction.
  Eigen::Vector3d ahead = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d up = -Eigen::Vector3d::UnitY();
};

// Up is opposite to the mean image-down direction (camera y axis) of all keyframes. A map does not know
// gravity; people hold cameras level on average, and the mean over many keyframes is more reliable than the
// first one alone. Without keyframes, or if the directions cancel out, up is -y of the map.
Eigen::Vector3d UpInMap(const MapSnapshot& map);

// If the first keyframe looks straight up or down, `ahead` is any horizontal direction.
UprightAxes UprightAxesOf(const MapSnapshot& map);
// The same with an up direction that is known, a unit vector in the map.
UprightAxes UprightAxesOf(const MapSnapshot& map, const Eigen::Vector3d& up);

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>

#include "content/scene.h"
#include "engine/geometry/sim3.h"
#include "engine/map/map_snapshot.h"

// Where a map begins that is entered from another one. Pure functions; any thread.
namespace docent::app {

// The position of the first keyframe of a map whose position is known, in map units; empty if there is none.
std::optional<Eigen::Vector3d> BeginOf(const engine::MapSnapshot& map);

// The unit vector from the board of a signpost in map A to where map B begins, for maps that are related by a
// similarity; empty if map B has no beginning, or begins within the height of the board from it.
std::optional<Eigen::Vector3d> DirectionToMap(const content::Signpost& signpost, const engine::Sim3& a_from_b,
                                              const engine::MapSnapshot& b);

}  // namespace docent::app

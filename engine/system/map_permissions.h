// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <optional>

namespace docent::engine {

// What the application allows for a map.
struct MapPermissions {
  bool extend = true;                         // keyframes may be added, and the map adjusted
  std::optional<Eigen::AlignedBox3d> bounds;  // new keyframes only with their centre inside; map frame
  bool join = true;                           // may be joined with another map
  bool discard = true;                        // may be discarded while it is provisional or has no depth
};

}  // namespace docent::engine

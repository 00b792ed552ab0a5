// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace docent::engine {

// A triangle mesh of the surfaces of a map. Counted from the side that was seen, the corners of a triangle
// run counterclockwise.
struct SurfaceMesh {
  std::vector<Eigen::Vector3f> vertices;                // in the map, map units
  std::vector<std::array<std::uint32_t, 3>> triangles;  // indices of vertices

  bool empty() const { return triangles.empty(); }  // Whether there is no surface.
};

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "app/simulator/surfaces.h"
#include "engine/dense/surface_mesh.h"

namespace docent::app {

// The surfaces of a simulated world without error, in triangles with sides of about cell_m.
inline engine::SurfaceMesh ExactMesh(const Surfaces& surfaces, double cell_m) {
  engine::SurfaceMesh mesh;
  for (const Rectangle& rectangle : surfaces.rectangles()) {
    const auto steps = [&](const Eigen::Vector3d& half) {
      return std::max(1, static_cast<int>(std::ceil(2 * half.norm() / cell_m)));
    };
    const int columns = steps(rectangle.half_u), rows = steps(rectangle.half_v);
    const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
    const auto width = static_cast<std::uint32_t>(columns + 1);
    for (int y = 0; y <= rows; ++y) {
      for (int x = 0; x <= columns; ++x)
        mesh.vertices.push_back((rectangle.center + (2.0 * x / columns - 1) * rectangle.half_u +
                                 (2.0 * y / rows - 1) * rectangle.half_v)
                                    .cast<float>());
    }
    for (std::uint32_t y = 0; y < static_cast<std::uint32_t>(rows); ++y) {
      for (std::uint32_t x = 0; x < static_cast<std::uint32_t>(columns); ++x) {
        // Seen from the front, u points to the right and v down, so that this order is counterclockwise.
        const std::uint32_t corner = first + y * width + x;
        mesh.triangles.push_back({corner, corner + width, corner + 1});
        mesh.triangles.push_back({corner + 1, corner + width, corner + width + 1});
      }
    }
  }
  return mesh;
}

}  // namespace docent::app

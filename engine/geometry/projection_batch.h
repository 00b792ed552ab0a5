// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>

namespace docent::engine {

// Points that CameraModel projects at once. A column holds one number per point, so that a loop over them
// fills vector registers.
struct ProjectionBatch {
  static constexpr std::size_t kSize = 16;  // a multiple of every vector register's size; no other was tried
  using Column = std::array<double, kSize>;

  // Given: the pixel at which a point was measured, and the point in the camera frame, in any unit of length.
  // What a batch has no points for is filled with any finite numbers.
  alignas(32) Column measured_x, measured_y, x, y, z;
  // Found: the pixel, and its derivatives by the point: yx is d pixel_y / d x. They mean something only where
  // `valid` is 1; it is 0 for a point that the lens does not project.
  alignas(32) Column pixel_x, pixel_y, xx, xy, xz, yx, yy, yz, valid;
};

}  // namespace docent::engine

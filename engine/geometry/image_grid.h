// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>

#include "engine/geometry/camera_model.h"

namespace docent::engine {

// The number of the cell at a column and a row of a grid; a cell outside the grid is the nearest one at its
// border.
inline std::size_t GridIndex(int column, int row, int columns, int rows) {
  return static_cast<std::size_t>(std::clamp(row, 0, rows - 1) * columns +
                                  std::clamp(column, 0, columns - 1));
}

// The cell, counted row by row, of a grid that divides the camera's image into `columns` by `rows` cells of
// equal size. A pixel outside the image belongs to the nearest cell at its border. `pixel` is on pyramid
// level 0.
inline std::size_t GridCell(const Eigen::Vector2d& pixel, const CameraModel& camera, int columns, int rows) {
  return GridIndex(static_cast<int>(pixel.x() * columns / camera.width_px()),
                   static_cast<int>(pixel.y() * rows / camera.height_px()), columns, rows);
}

// The same for a whole pixel.
inline std::size_t GridCell(const Eigen::Vector2i& pixel, const CameraModel& camera, int columns, int rows) {
  return GridIndex(pixel.x() * columns / camera.width_px(), pixel.y() * rows / camera.height_px(), columns,
                   rows);
}

}  // namespace docent::engine

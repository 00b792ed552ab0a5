// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "engine/dense/surface_mesh.h"
#include "engine/map/map_snapshot.h"

namespace docent::engine {

// A point of the surfaces of a map with what the keyframes show there.
struct SurfaceSample {
  Eigen::Vector3d point,
      normal;             // In the map; the normal has unit length and points to the side that is seen.
  double brightness = 0;  // Linear; the exposures of the keyframes are equalized, with a mean of 1.
};

// At most `count` points, evenly by area, that at least two keyframes show well. Of more than max_keyframes,
// some are chosen evenly; their pyramid level is the finest that is not wider than max_width_px.
// Deterministic.
std::vector<SurfaceSample> SampleSurfaces(const MapSnapshot& map, const SurfaceMesh& mesh, std::size_t count,
                                          int max_keyframes, int max_width_px);

// The linear brightness of an image's grey level of 0 to 255 (IEC 61966-2-1), 0 to 1.
double LinearFromLevel(double level);

}  // namespace docent::engine

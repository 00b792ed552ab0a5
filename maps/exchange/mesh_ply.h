// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "engine/dense/surface_mesh.h"

namespace docent::maps {

// A binary PLY file of a mesh, as other programs read it: vertices in map units, and triangles.
std::string MakeMeshPly(const engine::SurfaceMesh& mesh);

}  // namespace docent::maps

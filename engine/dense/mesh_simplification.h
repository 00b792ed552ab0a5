// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>

#include "engine/dense/surface_mesh.h"

namespace docent::engine {

// Removes vertices by collapsing edges, the one first that moves the surface least (Garland and Heckbert
// 1997), until every further one would move it by more than max_distance (map units), and then until at most
// max_triangles are left. Borders keep their shape. Stops early, with what has been reached, when asked to.
// Deterministic; pure.
SurfaceMesh SimplifyMesh(const SurfaceMesh& mesh, double max_distance, std::size_t max_triangles,
                         const std::atomic<bool>* interrupt = nullptr);

// The mesh cut along the edges that more than two triangles share, and at vertices where sheets only touch
// (Gueziec et al. 2001): each sheet has vertices of its own. Such edges cannot be collapsed, and where noise
// makes many of them they would use up the triangles that surfaces need. The triangles stay. Deterministic;
// pure.
SurfaceMesh CutSharedEdges(const SurfaceMesh& mesh);

// The mesh without connected pieces of fewer than min_triangles.
SurfaceMesh RemoveSmallPieces(const SurfaceMesh& mesh, std::size_t min_triangles);

}  // namespace docent::engine

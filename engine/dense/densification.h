// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/dense/depth_estimation.h"
#include "engine/dense/surface_mesh.h"

// The surfaces of a map as one mesh: the depth of every keyframe, fused and simplified. Takes seconds per
// keyframe, so it belongs in the background. Deterministic.
namespace docent::engine {

struct DensificationOptions {
  DepthOptions depth;
  // Side of a voxel, relative to the median depth of the map's points: about the width of three pixels of an
  // image of 640 pixels there.
  double voxel_size = 0.006;
  double truncation_voxels = 5;           // How far around a surface its distance is kept.
  double min_weight = 1;                  // Depth maps that must have measured a surface.
  std::size_t max_blocks = 60'000;        // Bounds memory, 2 KiB each. If there are more, voxels grow.
  double simplification_voxels = 0.3;     // Simplification moves the surface by less than this.
  std::size_t min_piece_triangles = 200;  // Smaller pieces of the surface before simplification are removed.
  std::size_t max_triangles = 150'000;    // Of the mesh, so that it takes less than 2 MB when stored.

  // Describes the first invalid option, or empty.
  std::optional<std::string> Validate() const;
};

// One keyframe that a mesh was made from, with its pose at that time.
struct MeshKeyFrame {
  KeyFrameId keyframe = kNoId;
  Rigid3 camera_from_map;
};

// A mesh and what it was made from.
struct MapMesh {
  SurfaceMesh mesh;
  std::vector<MeshKeyFrame> keyframes;  // by ascending id
};

// Whether a mesh still describes a map.
enum class MeshState {
  kCurrent,    // It was made from all the keyframes with depth, at their present poses.
  kExtended,   // The map has further keyframes; what the mesh shows is still right.
  kOutOfDate,  // A keyframe has moved or is gone: the mesh may be wrong.
};
MeshState StateOf(const std::vector<MeshKeyFrame>& keyframes, const MapSnapshot& map);

// The mesh of a map; without triangles if no keyframe has depth. `progress`, unless null, is called with the
// number of keyframes that are done and their total number. Empty when asked to stop. Throws Error if the
// options are invalid.
using DensificationProgress = std::function<void(std::size_t done, std::size_t total)>;
std::optional<MapMesh> DensifyMap(const std::shared_ptr<const MapSnapshot>& map,
                                  const DensificationOptions& options = {},
                                  const DensificationProgress& progress = {},
                                  const std::atomic<bool>* interrupt = nullptr);

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <map>
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

// Called with the number of keyframes whose depth is done and their total number.
using DensificationProgress = std::function<void(std::size_t done, std::size_t total)>;

// Computes the mesh of one state of a map. When it is interrupted, it keeps the depths that are done: about
// half a megabyte for each keyframe. One thread at a time.
class Densification {
 public:
  // Throws Error if the options are invalid.
  explicit Densification(std::shared_ptr<const MapSnapshot> map, const DensificationOptions& options = {});

  const std::shared_ptr<const MapSnapshot>& map() const { return map_; }
  // The mesh; without triangles if no keyframe has depth. Empty when asked to stop; the next call continues.
  // progress may be empty.
  std::optional<MapMesh> Run(const DensificationProgress& progress = {},
                             const std::atomic<bool>* interrupt = nullptr);

 private:
  bool EstimateDepths(const DensificationProgress& progress, const std::atomic<bool>* interrupt);
  std::vector<DepthMap> ConsistentDepths() const;

  const std::shared_ptr<const MapSnapshot> map_;
  const DensificationOptions options_;
  DepthEstimator estimator_;
  std::map<KeyFrameId, DepthMap> depths_;  // not yet checked against each other
};

// The same in one call.
std::optional<MapMesh> DensifyMap(const std::shared_ptr<const MapSnapshot>& map,
                                  const DensificationOptions& options = {},
                                  const DensificationProgress& progress = {},
                                  const std::atomic<bool>* interrupt = nullptr);

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "engine/dense/depth_map.h"
#include "engine/dense/surface_mesh.h"

namespace docent::engine {

// Fuses depth maps to surfaces: a truncated signed distance field (Curless and Levoy 1996) in blocks of
// voxels that are found by a hash of their position (Niessner et al. 2013), so that memory grows with the
// area of the surfaces. Distances are measured along the rays, positive on the side of the camera. The result
// does not depend on anything but the depth maps and their order. One thread at a time.
class DistanceField {
 public:
  // Lengths in map units, both positive.
  DistanceField(double voxel_size, double truncation);

  // Adds a depth map. Returns false, and adds no further blocks, once there are more than max_blocks.
  bool Add(const DepthMap& depth, std::size_t max_blocks, const std::atomic<bool>* interrupt = nullptr);
  // The surface between voxels that at least min_weight depth maps measured, by surface nets (Gibson 1998):
  // one vertex in each cell that the surface passes through.
  SurfaceMesh ExtractSurface(double min_weight) const;

  double voxel_size() const { return voxel_size_; }
  std::size_t blocks() const { return blocks_.size(); }
  static constexpr int kBlockSide = 8;  // voxels
  static constexpr std::size_t kBlockBytes = kBlockSide * kBlockSide * kBlockSide * 4;

 private:
  struct Voxel {
    std::int16_t distance = 0;  // Mean, in 1 / 32767 of the truncation.
    std::uint16_t weight = 0;   // Sum of the confidences, in 1 / kWeightScale.
  };
  struct Block {
    Eigen::Vector3i origin;  // Its first voxel.
    std::array<Voxel, kBlockSide * kBlockSide * kBlockSide> voxels;
  };
  static constexpr double kWeightScale = 100;

  // Creates the blocks within the truncation of the surfaces of a depth map; false if they become too many.
  bool CreateBlocks(const DepthMap& depth, std::size_t max_blocks);
  void UpdateBlock(const DepthMap& depth, Block* block) const;
  std::size_t FindOrAddBlock(const Eigen::Vector3i& block);
  const Voxel* FindVoxel(const Eigen::Vector3i& voxel) const;

  double voxel_size_, truncation_;
  std::vector<Block> blocks_;                              // In the order of their creation.
  std::unordered_map<std::uint64_t, std::size_t> lookup_;  // From the position of a block to its index.
};

}  // namespace docent::engine

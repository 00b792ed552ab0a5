// SPDX-License-Identifier: Apache-2.0
#include "engine/dense/distance_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/base/interrupt.h"

namespace docent::engine {
namespace {

constexpr int kBlockShift = 3;
static_assert(DistanceField::kBlockSide == 1 << kBlockShift);
constexpr double kDistanceScale = 32767;
constexpr std::uint32_t kNoVertex = 0xFFFFFFFFu;
// Blocks are numbered by 21 bits for each axis.
constexpr int kMaxBlockNumber = (1 << 20) - 1;

std::uint64_t KeyOf(const Eigen::Vector3i& block) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis)
    key = key << 21 | static_cast<std::uint64_t>(block[axis] + kMaxBlockNumber + 1);
  return key;
}

std::size_t IndexInBlock(const Eigen::Vector3i& voxel) {
  constexpr int kMask = DistanceField::kBlockSide - 1;
  return static_cast<std::size_t>(((voxel.z() & kMask) << (2 * kBlockShift)) |
                                  ((voxel.y() & kMask) << kBlockShift) | (voxel.x() & kMask));
}

Eigen::Vector3i BlockOf(const Eigen::Vector3i& voxel) {
  return {voxel.x() >> kBlockShift, voxel.y() >> kBlockShift, voxel.z() >> kBlockShift};
}

Eigen::Vector3i CornerOf(int corner) {
  return {corner & 1, corner >> 1 & 1, corner >> 2};
}

// A cell whose corners are eight voxels, the first of which gives its position.
struct Cell {
  std::array<float, 8> distances;  // In truncations; by CornerOf.
  unsigned measured = 0;           // A bit for each corner whose distance is known.

  bool IsMeasured(int corner) const { return (measured >> corner & 1U) != 0; }
  bool IsOutside(int corner) const { return distances[static_cast<std::size_t>(corner)] >= 0; }

  // The mean of the places on its measured edges where the distance is zero, in voxels from its first corner.
  // There must be one.
  Eigen::Vector3d Vertex() const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int count = 0;
    for (int a = 0; a < 8; ++a) {
      for (const int axis : {1, 2, 4}) {
        const int b = a | axis;
        if (b == a || !IsMeasured(a) || !IsMeasured(b) || IsOutside(a) == IsOutside(b)) continue;
        const double from = distances[static_cast<std::size_t>(a)],
                     to = distances[static_cast<std::size_t>(b)];
        const double share = from / (from - to);
        sum += CornerOf(a).cast<double>() * (1 - share) + CornerOf(b).cast<double>() * share;
        ++count;
      }
    }
    return sum / count;
  }
};

}  // namespace

DistanceField::DistanceField(double voxel_size, double truncation)
    : voxel_size_(voxel_size), truncation_(truncation) {}

std::size_t DistanceField::FindOrAddBlock(const Eigen::Vector3i& block) {
  const auto [entry, added] = lookup_.try_emplace(KeyOf(block), blocks_.size());
  if (added) blocks_.push_back({block * kBlockSide, {}});
  return entry->second;
}

const DistanceField::Voxel* DistanceField::FindVoxel(const Eigen::Vector3i& voxel) const {
  const auto found = lookup_.find(KeyOf(BlockOf(voxel)));
  return found == lookup_.end() ? nullptr : &blocks_[found->second].voxels[IndexInBlock(voxel)];
}

bool DistanceField::CreateBlocks(const DepthMap& depth, std::size_t max_blocks) {
  const Rigid3 map_from_camera = depth.camera_from_map.inverse();
  const Eigen::Matrix3d rotation = map_from_camera.rotation.matrix();
  const double block_size = voxel_size_ * kBlockSide;
  // Points along the ray are half a block apart, so that no block is skipped but for a corner.
  const int steps = static_cast<int>(std::ceil(2 * truncation_ / (0.5 * block_size)));
  for (int y = 0; y < depth.inverse_distance.rows; ++y) {
    for (int x = 0; x < depth.inverse_distance.cols; ++x) {
      const double inverse = depth.inverse_distance.at<float>(y, x);
      if (inverse <= 0) continue;
      const Eigen::Vector3d ray = rotation * depth.rays->At(x, y).cast<double>();
      for (int i = 0; i <= steps; ++i) {
        const double distance = 1 / inverse + truncation_ * (2.0 * i / steps - 1);
        const Eigen::Vector3d place = (map_from_camera.translation + distance * ray) / block_size;
        if (distance <= 0 || place.cwiseAbs().maxCoeff() >= kMaxBlockNumber) continue;
        FindOrAddBlock(place.array().floor().cast<int>());
      }
      if (blocks_.size() > max_blocks) return false;
    }
  }
  return true;
}

void DistanceField::UpdateBlock(const DepthMap& depth, Block* block) const {
  for (int i = 0; i < kBlockSide * kBlockSide * kBlockSide; ++i) {
    const Eigen::Vector3i voxel = block->origin + Eigen::Vector3i(i % kBlockSide, i / kBlockSide % kBlockSide,
                                                                  i / kBlockSide / kBlockSide);
    const Eigen::Vector3d point_in_camera =
        depth.camera_from_map * Eigen::Vector3d(voxel.cast<double>() * voxel_size_);
    const auto pixel = depth.rays->Project(point_in_camera);
    if (!pixel) continue;
    const double inverse = InverseDistanceAt(depth, *pixel);
    if (inverse <= 0) continue;
    const double distance = (1 / inverse - point_in_camera.norm()) / truncation_;
    if (distance < -1) continue;  // Behind the surface, where nothing is known.
    const double measured = std::min(distance, 1.0) * kDistanceScale;
    Voxel& stored = block->voxels[IndexInBlock(voxel)];
    const double before = stored.weight, total = before + kWeightScale;
    if (total > std::numeric_limits<std::uint16_t>::max()) continue;
    stored.distance =
        static_cast<std::int16_t>(std::lround((stored.distance * before + measured * kWeightScale) / total));
    stored.weight = static_cast<std::uint16_t>(total);
  }
}

bool DistanceField::Add(const DepthMap& depth, std::size_t max_blocks, const std::atomic<bool>* interrupt) {
  if (!CreateBlocks(depth, max_blocks)) return false;
  // Blocks whose bounding sphere leaves the image are left to UpdateBlock; those behind the camera are many.
  const double radius = voxel_size_ * kBlockSide;
  for (Block& block : blocks_) {
    if (IsInterrupted(interrupt)) return false;
    const Eigen::Vector3d middle = (block.origin.cast<double>().array() + kBlockSide / 2.0) * voxel_size_;
    const Eigen::Vector3d in_camera = depth.camera_from_map * middle;
    const bool is_near = in_camera.norm() < 2 * radius;
    if (is_near || depth.rays->Project(in_camera)) UpdateBlock(depth, &block);
  }
  return true;
}

SurfaceMesh DistanceField::ExtractSurface(double min_weight) const {
  const auto least = static_cast<std::uint16_t>(std::max(1.0, min_weight * kWeightScale));
  const auto cell_at = [&](const Eigen::Vector3i& first) {
    Cell cell;
    for (int corner = 0; corner < 8; ++corner) {
      const Voxel* const voxel = FindVoxel(first + CornerOf(corner));
      if (voxel == nullptr || voxel->weight < least) continue;
      cell.measured |= 1U << corner;
      cell.distances[static_cast<std::size_t>(corner)] = static_cast<float>(voxel->distance / kDistanceScale);
    }
    return cell;
  };
  SurfaceMesh mesh;
  constexpr std::size_t kVoxels = kBlockSide * kBlockSide * kBlockSide;
  std::vector<std::uint32_t> vertex_of(blocks_.size() * kVoxels, kNoVertex);
  // The vertex of a cell that the surface passes through; kNoVertex where there is no block.
  const auto vertex_at = [&](const Eigen::Vector3i& first) {
    const auto found = lookup_.find(KeyOf(BlockOf(first)));
    if (found == lookup_.end()) return kNoVertex;
    std::uint32_t& vertex = vertex_of[found->second * kVoxels + IndexInBlock(first)];
    if (vertex == kNoVertex) {
      vertex = static_cast<std::uint32_t>(mesh.vertices.size());
      mesh.vertices.push_back(((first.cast<double>() + cell_at(first).Vertex()) * voxel_size_).cast<float>());
    }
    return vertex;
  };
  const auto for_each_voxel = [&](const auto& visit) {
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      for (std::size_t i = 0; i < kVoxels; ++i) {
        const int index = static_cast<int>(i);
        if (blocks_[b].voxels[i].weight < least) continue;
        visit(Eigen::Vector3i(blocks_[b].origin + Eigen::Vector3i(index % kBlockSide,
                                                                  index / kBlockSide % kBlockSide,
                                                                  index / kBlockSide / kBlockSide)));
      }
    }
  };
  // Each pair of neighbouring voxels on different sides has four cells around it, whose vertices form two
  // triangles.
  for_each_voxel([&](const Eigen::Vector3i& voxel) {
    const bool outside = FindVoxel(voxel)->distance >= 0;
    for (int axis = 0; axis < 3; ++axis) {
      const Voxel* const next = FindVoxel(voxel + Eigen::Vector3i::Unit(axis));
      if (next == nullptr || next->weight < least || (next->distance >= 0) == outside) continue;
      const Eigen::Vector3i u = Eigen::Vector3i::Unit((axis + 1) % 3),
                            v = Eigen::Vector3i::Unit((axis + 2) % 3);
      std::array<std::uint32_t, 4> corner = {vertex_at(voxel - u - v), vertex_at(voxel - v), vertex_at(voxel),
                                             vertex_at(voxel - u)};
      if (std::find(corner.begin(), corner.end(), kNoVertex) != corner.end()) continue;
      if (outside) std::swap(corner[1], corner[3]);  // The normal points along -axis.
      mesh.triangles.push_back({corner[0], corner[1], corner[2]});
      mesh.triangles.push_back({corner[0], corner[2], corner[3]});
    }
  });
  return mesh;
}

}  // namespace docent::engine

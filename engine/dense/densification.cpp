// SPDX-License-Identifier: Apache-2.0
#include "engine/dense/densification.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/base/interrupt.h"
#include "engine/base/median.h"
#include "engine/base/option_check.h"
#include "engine/dense/distance_field.h"
#include "engine/dense/mesh_simplification.h"

namespace docent::engine {
namespace {

// Fuses the depth maps with voxels of at least this size; with larger ones if there are too many blocks.
std::optional<DistanceField> Fuse(const std::vector<DepthMap>& depths, double voxel_size,
                                  const DensificationOptions& options, const std::atomic<bool>* interrupt) {
  constexpr double kGrowth = 1.5;
  for (;; voxel_size *= kGrowth) {
    DistanceField field(voxel_size, options.truncation_voxels * voxel_size);
    const bool fits = std::all_of(depths.begin(), depths.end(), [&](const DepthMap& depth) {
      return field.Add(depth, options.max_blocks, interrupt);
    });
    if (IsInterrupted(interrupt)) return std::nullopt;
    if (fits) return field;
  }
}

double MedianDepth(const MapSnapshot& map) {
  std::vector<double> depths;
  for (const KeyFrame& keyframe : map.keyframes) {
    if (keyframe.kind == KeyFrameKind::kSixDof) depths.push_back(keyframe.mean_depth);
  }
  return Median(std::move(depths));
}

}  // namespace

std::optional<std::string> DensificationOptions::Validate() const {
  return OptionCheck()
      .Contained(depth.Validate())
      .Within(voxel_size, 1e-4, 1, "size of a voxel")
      .Within(truncation_voxels, 1, 100, "truncation")
      .Positive(min_weight, "smallest weight")
      .AtLeast(static_cast<double>(max_blocks), 1, "number of blocks")
      .AtLeast(simplification_voxels, 0, "distance of the simplification")
      .AtLeast(static_cast<double>(max_triangles), 1, "number of triangles")
      .fault();
}

MeshState StateOf(const std::vector<MeshKeyFrame>& keyframes, const MapSnapshot& map) {
  // Movements below these change the image of the surfaces by less than a few pixels.
  constexpr double kMaxMovement = 0.01;  // Of the keyframe's mean depth.
  constexpr double kMaxRotation_rad = 0.005;
  for (const MeshKeyFrame& used : keyframes) {
    const KeyFrame* const now = map.FindKeyFrame(used.keyframe);
    if (now == nullptr || now->kind != KeyFrameKind::kSixDof) return MeshState::kOutOfDate;
    if (!IsNear(used.camera_from_map, now->camera_from_map, kMaxMovement * now->mean_depth, kMaxRotation_rad))
      return MeshState::kOutOfDate;
  }
  const auto localized =
      std::count_if(map.keyframes.begin(), map.keyframes.end(),
                    [](const KeyFrame& keyframe) { return keyframe.kind == KeyFrameKind::kSixDof; });
  return static_cast<std::size_t>(localized) > keyframes.size() ? MeshState::kExtended : MeshState::kCurrent;
}

Densification::Densification(std::shared_ptr<const MapSnapshot> map, const DensificationOptions& options)
    : map_(std::move(map)), options_(Checked(options)), estimator_(map_, options.depth) {}

// Returns false when asked to stop.
bool Densification::EstimateDepths(const DensificationProgress& progress,
                                   const std::atomic<bool>* interrupt) {
  for (const DepthViews& views : estimator_.views()) {
    if (depths_.contains(views.keyframe)) continue;
    std::optional<DepthMap> depth = estimator_.Estimate(views, interrupt);
    if (!depth) return false;
    depths_.emplace(views.keyframe, *std::move(depth));
    if (progress) progress(depths_.size(), estimator_.views().size());
  }
  return true;
}

// Each checked against its neighbours.
std::vector<DepthMap> Densification::ConsistentDepths() const {
  std::vector<DepthMap> consistent;
  for (const DepthViews& views : estimator_.views()) {
    std::vector<const DepthMap*> others;
    for (const KeyFrameId id : views.neighbours) {
      const auto found = depths_.find(id);
      if (found != depths_.end()) others.push_back(&found->second);
    }
    consistent.push_back(estimator_.KeepConsistent(depths_.at(views.keyframe), others));
  }
  return consistent;
}

std::optional<MapMesh> Densification::Run(const DensificationProgress& progress,
                                          const std::atomic<bool>* interrupt) {
  MapMesh result;
  for (const KeyFrame& keyframe : map_->keyframes) {
    if (keyframe.kind == KeyFrameKind::kSixDof)
      result.keyframes.push_back({keyframe.id, keyframe.camera_from_map});
  }
  if (!EstimateDepths(progress, interrupt)) return std::nullopt;
  if (depths_.empty()) return result;
  const auto field = Fuse(ConsistentDepths(), options_.voxel_size * MedianDepth(*map_), options_, interrupt);
  if (!field) return std::nullopt;
  const SurfaceMesh surface = RemoveSmallPieces(CutSharedEdges(field->ExtractSurface(options_.min_weight)),
                                                options_.min_piece_triangles);
  result.mesh = SimplifyMesh(surface, options_.simplification_voxels * field->voxel_size(),
                             options_.max_triangles, interrupt);
  if (IsInterrupted(interrupt)) return std::nullopt;
  return result;
}

std::optional<MapMesh> DensifyMap(const std::shared_ptr<const MapSnapshot>& map,
                                  const DensificationOptions& options, const DensificationProgress& progress,
                                  const std::atomic<bool>* interrupt) {
  return Densification(map, options).Run(progress, interrupt);
}

}  // namespace docent::engine

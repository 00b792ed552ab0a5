// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/loops/overlap_verification.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "engine/geometry/image_grid.h"

namespace docent::engine {
namespace {

constexpr int kVisibleCells = 4;

}  // namespace

std::size_t OverlapEvidence::Points() const {
  std::size_t points = 0;
  for (const LoopCandidate& candidate : candidates) points += candidate.seen.size();
  return points;
}

double OverlapEvidence::MedianFoundRatio() const {
  if (found_ratios.empty()) return 0;
  std::vector<double> ratios = found_ratios;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  return *middle;
}

std::optional<Sim3> OverlapVerification::Verify(KeyFrameId id, const Sim3& a_from_b,
                                                OverlapEvidence* evidence) {
  const Sim3 other_from_own = keyframes_.IsOfA(id) ? a_from_b.inverse() : a_from_b;
  const Rigid3 camera_from_other = CorrectedPose(At(id).camera_from_map, other_from_own);
  const std::vector<KeyFrameId> others =
      KeyFramesWithSameView(At(id), camera_from_other, other_from_own.scale);
  const std::vector<MapPointId> points = PointsInView(At(id), others, camera_from_other);
  if (points.empty()) return std::nullopt;
  ++evidence->with_view;
  auto candidate =
      VerifyLoopCandidate(options_.search.verification, id, others, camera_from_other, map_, &searcher_);
  if (!candidate) return std::nullopt;
  const Sim3 implied = KnownFromRecent(*candidate, map_);
  if (MagnitudeAt(other_from_own.inverse() * implied, At(id)).largest() > options_.max_disagreement)
    return std::nullopt;
  evidence->found_ratios.push_back(static_cast<double>(candidate->seen.size()) / candidate->expected);
  CompareSurfaces(*candidate, points, evidence);
  evidence->candidates.push_back(std::move(*candidate));
  return keyframes_.IsOfA(id) ? implied.inverse() : implied;
}

// Keyframes of the other map with about the same view, the most similar first. scale: of the other map's
// unit.
std::vector<KeyFrameId> OverlapVerification::KeyFramesWithSameView(const KeyFrame& keyframe,
                                                                   const Rigid3& camera_from_other,
                                                                   double scale) const {
  std::vector<std::pair<double, KeyFrameId>> ranked;
  for (const KeyFrameId id : keyframes_.IsOfA(keyframe.id) ? keyframes_.in_b : keyframes_.in_a) {
    const Rigid3& other = At(id).camera_from_map;
    const double distance =
        (camera_from_other.OriginInSource() - other.OriginInSource()).norm() / (scale * keyframe.mean_depth);
    // The angle between the optical axes, since a camera that rolls sees the same.
    const double cosine = (camera_from_other.rotation.inverse() * Eigen::Vector3d::UnitZ())
                              .dot(other.rotation.inverse() * Eigen::Vector3d::UnitZ());
    const double angle = std::acos(std::clamp(cosine, -1.0, 1.0));
    if (distance > options_.max_view_distance || angle > options_.max_view_angle) continue;
    ranked.emplace_back(distance + angle, id);
  }
  std::sort(ranked.begin(), ranked.end());
  if (ranked.size() > options_.search.max_group) ranked.resize(options_.search.max_group);
  std::vector<KeyFrameId> ids;
  for (const auto& [difference, id] : ranked) ids.push_back(id);
  return ids;
}

// Points of the given keyframes that should be visible in the keyframe; none if they are too few or do not
// cover enough of the image.
std::vector<MapPointId> OverlapVerification::PointsInView(const KeyFrame& keyframe,
                                                          const std::vector<KeyFrameId>& others,
                                                          const Rigid3& camera_from_other) {
  std::set<MapPointId> points;
  for (const KeyFrameId id : others) {
    for (const Observation& observation : map_->FindKeyFrame(id)->observations)
      points.insert(observation.point);
  }
  std::vector<MapPointId> in_view;
  std::set<std::size_t> cells;
  for (const MapPointId id : points) {
    const auto predicted = Predict(id, keyframe, camera_from_other);
    if (!predicted) continue;
    in_view.push_back(id);
    cells.insert(GridCell(predicted->pixel, *keyframe.camera, kVisibleCells, kVisibleCells));
  }
  if (static_cast<int>(in_view.size()) < options_.min_expected ||
      static_cast<int>(cells.size()) < options_.min_cells)
    in_view.clear();
  return in_view;
}

std::optional<PredictedPoint> OverlapVerification::Predict(MapPointId id, const KeyFrame& keyframe,
                                                           const Rigid3& camera_from_other) {
  const Map::PointRecord* const record = map_->FindPoint(id);
  if (!record || record->point.infinite()) return std::nullopt;
  const Map::KeyFrameRecord* const source = map_->FindKeyFrame(record->point.source_keyframe);
  if (!source) return std::nullopt;
  return searcher_.Predict(record->point, source->keyframe, *keyframe.camera, camera_from_other);
}

// True if the keyframe's own map has a surface at this pixel and about this depth.
bool OverlapVerification::HasSurface(const Map::KeyFrameRecord& keyframe, const Eigen::Vector2d& pixel,
                                     double depth) const {
  return std::any_of(keyframe.observations.begin(), keyframe.observations.end(),
                     [&](const Observation& observation) {
                       if ((observation.pixel.cast<double>() - pixel).norm() > options_.surface_px)
                         return false;
                       const Map::PointRecord* const point = map_->FindPoint(observation.point);
                       if (!point || point->point.infinite()) return false;
                       const double own = (keyframe.keyframe.camera_from_map * point->point.position()).z();
                       return std::abs(own - depth) <= options_.surface_depth * depth;
                     });
}

// Where both maps have a surface at the same depth, the points of one must be found in a keyframe of the
// other, unless the surfaces differ.
void OverlapVerification::CompareSurfaces(const LoopCandidate& candidate,
                                          const std::vector<MapPointId>& points, OverlapEvidence* evidence) {
  const Map::KeyFrameRecord& record = *map_->FindKeyFrame(candidate.keyframe);
  const KeyFrame& keyframe = record.keyframe;
  const Sim3 seen_from_other = candidate.keyframe_from_place * AsSim3(At(candidate.place).camera_from_map);
  const Rigid3 camera_from_other{seen_from_other.rotation,
                                 seen_from_other.translation / seen_from_other.scale};
  struct Region {
    int points = 0, found = 0;
  };
  std::map<std::size_t, Region> regions;
  for (const MapPointId id : points) {
    const auto predicted = Predict(id, keyframe, camera_from_other);
    if (!predicted) continue;
    const MapPoint& point = map_->FindPoint(id)->point;
    const auto match = searcher_.Find(point, At(point.source_keyframe), *predicted, *keyframe.features,
                                      options_.search.verification.radius_px, false);
    const bool found = match && (match->pixel.cast<double>() - predicted->pixel).norm() <=
                                    options_.max_error_px * (1 << predicted->level);
    const double depth = seen_from_other.scale * predicted->point_in_camera.z();
    if (!found && !HasSurface(record, predicted->pixel, depth)) continue;
    Region& region = regions[GridCell(predicted->pixel, *keyframe.camera, options_.regions_across,
                                      options_.regions_across)];
    ++region.points;
    region.found += found ? 1 : 0;
  }
  for (const auto& [cell, region] : regions) {
    if (region.points < options_.min_region_points) continue;
    ++evidence->regions;
    if (region.found <= options_.min_region_found_ratio * region.points) ++evidence->contradicted;
  }
}

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/keyframe_insertion.h"

#include <algorithm>
#include <cmath>

#include "engine/map/map_readout.h"
#include "engine/matching/pose_refinement.h"

namespace docent::engine {

void KeyFrameInsertion::Insert(const KeyFrameCandidate& offered, std::span<const PointReport> reports) {
  ApplyReports(reports);
  KeyFrameCandidate candidate = WithCorrections(offered);
  const bool moved = candidate.map_revision != 0 && candidate.map_revision < workspace_->map.moved_in();
  if (moved) candidate.camera_from_map = PoseInPresentMap(candidate);
  if (candidate.choice == KeyFrameChoice::kPanorama) {
    panoramas_->Insert(candidate);
  } else {
    InsertSixDof(candidate);
  }
}

Rigid3 KeyFrameInsertion::PoseInPresentMap(const KeyFrameCandidate& candidate) {
  // Of a candidate of a panorama map only the rotation is known.
  const bool is_rotation = candidate.choice == KeyFrameChoice::kPanorama;
  const int min_points = is_rotation ? 15 : 30;  // five times as many as degrees of freedom
  std::vector<PoseMeasurement> measurements;
  for (const PointMatch& match : candidate.matches) {
    const Map::PointRecord* point = workspace_->map.FindPoint(match.point);
    if (!point || point->point.infinite() != is_rotation) continue;
    if (is_rotation && point->point.panorama != candidate.panorama) continue;
    measurements.push_back({point->point.point_in_map, match.pixel.cast<double>(),
                            1.0 / static_cast<double>(1 << match.level), 1.0});
  }
  if (static_cast<int>(measurements.size()) < min_points) return candidate.camera_from_map;
  PoseRefinementMemory memory;
  const Rigid3& start = candidate.camera_from_map;
  const PoseRefinement refined =
      RefinePose(*candidate.camera, start, {}, &measurements, &memory, {Eigen::Vector3d::Zero(), start});
  const auto observed = is_rotation ? ObservedMotion::kPanorama : ObservedMotion::kSixDof;
  const bool found = refined.converged && refined.observed == observed &&
                     2 * refined.inliers > static_cast<int>(measurements.size());
  return found ? refined.camera_from_map : start;
}

KeyFrameCandidate KeyFrameInsertion::WithCorrections(KeyFrameCandidate candidate) const {
  candidate.camera = WithReadoutIn(workspace_->map, lens_estimation_->CurrentModel(candidate.camera));
  if (candidate.map_revision == 0) return candidate;
  for (const auto& correction : workspace_->map.corrections()) {
    if (correction->revision <= candidate.map_revision) continue;
    const auto moved = correction->after_from_before.find(candidate.reference_keyframe);
    if (moved != correction->after_from_before.end())
      candidate.camera_from_map = CorrectedPose(candidate.camera_from_map, moved->second);
  }
  return candidate;
}

void KeyFrameInsertion::ApplyReports(std::span<const PointReport> reports) {
  constexpr int kMinTries = 20;
  for (const PointReport& report : reports) {
    Map::PointRecord* record = workspace_->map.FindPoint(report.point);
    if (!record) continue;
    record->seen_inlier += report.inlier;
    record->seen_outlier += report.outlier;
    record->not_found += report.not_found;
    const int tries = record->seen_inlier + record->seen_outlier + record->not_found;
    // Points that are mostly matched in the wrong place, or never beyond their first two views, harm
    // tracking.
    const bool wrong = record->seen_outlier > kMinTries && record->seen_outlier > record->seen_inlier;
    const std::size_t first_views = record->point.infinite() ? 1 : 2;
    const bool unconfirmed =
        tries > kMinTries && record->observers.size() <= first_views && record->seen_inlier * 5 < tries;
    if (wrong || unconfirmed) workspace_->map.RemovePoint(report.point);
  }
}

void KeyFrameInsertion::InsertSixDof(const KeyFrameCandidate& candidate) {
  Map& map = workspace_->map;
  KeyFrame keyframe;
  keyframe.time = candidate.time;
  keyframe.camera = candidate.camera;
  keyframe.features = candidate.features;
  keyframe.camera_from_map = candidate.camera_from_map;
  Map::KeyFrameRecord* record = &map.AddKeyFrame(keyframe);
  const KeyFrameId id = record->keyframe.id;
  for (const PointMatch& match : candidate.matches) {
    const Map::PointRecord* point = map.FindPoint(match.point);
    if (point && !point->point.infinite()) map.AddObservation({id, match.point, match.pixel, match.level});
  }
  map.UpdateDepth(record);
  MatchMapPoints(options_.guided_matching, id, &workspace_->searcher, &map);
  map.UpdateDepth(record);
  std::vector<MapPointId> created;
  for (const KeyFrameId neighbour : Neighbours(id)) {
    const auto points = CreatePoints(options_.creation, id, neighbour, &map, &workspace_->searcher);
    created.insert(created.end(), points.begin(), points.end());
  }
  refinement_->AddPoints(created);
  int rays = 0;
  if (candidate.choice == KeyFrameChoice::kLocalizedPanorama) {
    map.OpenPanorama(id);
    rays = AddInfinitePoints(options_.infinite, id, {}, &map);
  }
  panoramas_->PlanConversions(id);
  refinement_->AddKeyFrame(id);
  loops_->Enqueue(id);
  output_->Publish(map.Snapshot());
  if (candidate.choice == KeyFrameChoice::kLocalizedPanorama) {
    output_->AddEvent(candidate.time, MapperEvent::PanoramaOpened{rays});
  } else {
    output_->AddEvent(candidate.time, MapperEvent::KeyFrameAdded{created.size(), map.AlivePoints()});
  }
}

std::vector<KeyFrameId> KeyFrameInsertion::Neighbours(KeyFrameId id) {
  Map& map = workspace_->map;
  const Map::KeyFrameRecord& record = *map.FindKeyFrame(id);
  const Eigen::Vector3d center = record.keyframe.camera_from_map.OriginInSource();
  struct Scored {
    double score;
    KeyFrameId id;
  };
  std::vector<Scored> scored;
  for (const auto& [other, shared] : map.Covisible(id)) {
    if (shared < 15) break;
    const Rigid3& pose = map.FindKeyFrame(other)->keyframe.camera_from_map;
    const double baseline = (pose.OriginInSource() - center).norm() / record.keyframe.mean_depth;
    if (baseline < options_.min_neighbour_baseline || baseline > options_.max_neighbour_baseline) continue;
    // Large overlap helps matching; a baseline of about 0.15 depths helps triangulation.
    const double fit = std::min(baseline / 0.15, 0.15 / baseline);
    scored.push_back({-shared * std::sqrt(fit), other});
  }
  std::stable_sort(scored.begin(), scored.end(),
                   [](const Scored& a, const Scored& b) { return a.score < b.score; });
  std::vector<KeyFrameId> neighbours;
  for (const Scored& neighbour : scored) {
    if (static_cast<int>(neighbours.size()) >= options_.neighbours) break;
    neighbours.push_back(neighbour.id);
  }
  return neighbours;
}

}  // namespace docent::engine

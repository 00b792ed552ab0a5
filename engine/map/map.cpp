// SPDX-License-Identifier: Apache-2.0
#include "engine/map/map.h"

#include <algorithm>
#include <cmath>

namespace docent::engine {

namespace {

auto FindObservation(std::vector<Observation>& observations, MapPointId point) {
  return std::lower_bound(
      observations.begin(), observations.end(), point,
      [](const Observation& observation, MapPointId id) { return observation.point < id; });
}

}  // namespace

Map::Map(const MapSnapshot& snapshot)
    : panoramas_(snapshot.panoramas),
      corrections_(snapshot.corrections),
      next_keyframe_(snapshot.next_keyframe),
      next_point_(snapshot.next_point),
      next_panorama_(snapshot.next_panorama),
      revision_(snapshot.revision),
      moved_in_(snapshot.revision) {
  for (const KeyFrame& keyframe : snapshot.keyframes) keyframes_[keyframe.id].keyframe = keyframe;
  points_.reserve(snapshot.points.size());
  point_ids_.reserve(snapshot.points.size());
  for (const MapPoint& point : snapshot.points) {
    points_.push_back({.point = point, .observers = {}});
    point_ids_.push_back(point.id);
  }
  alive_points_ = points_.size();
  for (const Observation& observation : snapshot.observations) AddObservation(observation);
}

Map::KeyFrameRecord& Map::AddKeyFrame(KeyFrame keyframe) {
  keyframe.id = next_keyframe_++;
  KeyFrameRecord& record = keyframes_[keyframe.id];
  record.keyframe = std::move(keyframe);
  return record;
}

MapPointId Map::AddPoint(MapPoint point) {
  point.id = next_point_++;
  points_.push_back({.point = point, .observers = {}});
  point_ids_.push_back(point.id);
  ++alive_points_;
  return point.id;
}

Map::PointRecord* Map::FindPoint(MapPointId id) {
  const auto it = std::ranges::lower_bound(point_ids_, id);
  if (it == point_ids_.end() || *it != id) return nullptr;
  PointRecord& record = points_[static_cast<std::size_t>(it - point_ids_.begin())];
  return record.alive ? &record : nullptr;
}

Map::KeyFrameRecord* Map::FindKeyFrame(KeyFrameId id) {
  const auto it = keyframes_.find(id);
  return it != keyframes_.end() ? &it->second : nullptr;
}

bool Map::AddObservation(const Observation& observation) {
  KeyFrameRecord* keyframe = FindKeyFrame(observation.keyframe);
  PointRecord* point = FindPoint(observation.point);
  if (!keyframe || !point) return false;
  const auto it = FindObservation(keyframe->observations, observation.point);
  if (it != keyframe->observations.end() && it->point == observation.point) return false;
  keyframe->observations.insert(it, observation);
  point->observers.insert(
      std::upper_bound(point->observers.begin(), point->observers.end(), observation.keyframe),
      observation.keyframe);
  return true;
}

void Map::RemoveObservation(KeyFrameId keyframe, MapPointId point) {
  KeyFrameRecord* keyframe_record = FindKeyFrame(keyframe);
  PointRecord* point_record = FindPoint(point);
  if (!keyframe_record || !point_record) return;
  const auto it = FindObservation(keyframe_record->observations, point);
  if (it == keyframe_record->observations.end() || it->point != point) return;
  const std::size_t fewest = point_record->point.infinite() ? 1 : 2;
  if (point_record->observers.size() <= fewest || point_record->point.source_keyframe == keyframe) {
    RemovePoint(point);
    return;
  }
  keyframe_record->observations.erase(it);
  std::erase(point_record->observers, keyframe);
}

void Map::RemovePoint(MapPointId id) {
  PointRecord* record = FindPoint(id);
  if (!record) return;
  for (const KeyFrameId observer : record->observers) {
    std::vector<Observation>& observations = keyframes_.at(observer).observations;
    const auto it = FindObservation(observations, id);
    if (it != observations.end() && it->point == id) observations.erase(it);
  }
  record->observers.clear();
  record->alive = false;
  --alive_points_;
}

void Map::RemoveKeyFrame(KeyFrameId id) {
  KeyFrameRecord* record = FindKeyFrame(id);
  if (!record) return;
  const std::vector<Observation> observations = record->observations;
  for (const Observation& observation : observations) RemoveObservation(id, observation.point);
  // A stored map may contain points that their own source keyframe does not observe.
  for (const PointRecord& point : points_) {
    if (point.alive && point.point.source_keyframe == id) RemovePoint(point.point.id);
  }
  const PanoramaId panorama = record->keyframe.panorama;
  const bool reference = record->keyframe.kind == KeyFrameKind::kSixDof && panorama != kNoId;
  keyframes_.erase(id);
  if (reference) ClosePanorama(panorama);
}

void Map::FusePoints(MapPointId into, MapPointId duplicate) {
  PointRecord* kept = FindPoint(into);
  const PointRecord* gone = FindPoint(duplicate);
  if (!kept || !gone || kept == gone) return;
  const std::vector<KeyFrameId> observers = gone->observers;
  for (const KeyFrameId observer : observers) {
    std::vector<Observation>& observations = keyframes_.at(observer).observations;
    const auto it = FindObservation(observations, duplicate);
    if (it == observations.end() || it->point != duplicate) continue;
    Observation observation = *it;
    observation.point = into;
    AddObservation(observation);
  }
  kept->seen_inlier += gone->seen_inlier;
  kept->seen_outlier += gone->seen_outlier;
  kept->not_found += gone->not_found;
  RemovePoint(duplicate);
}

void Map::Correct(const std::map<KeyFrameId, Sim3>& after_from_before) {
  std::map<KeyFrameId, Sim3> correction_of;
  for (auto& [id, record] : keyframes_) {
    KeyFrame& keyframe = record.keyframe;
    KeyFrameId leader = id;
    if (keyframe.kind == KeyFrameKind::kPanorama) {
      for (const PanoramaMap& panorama : panoramas_) {
        if (panorama.id == keyframe.panorama) leader = panorama.reference;
      }
    }
    const auto found = after_from_before.find(leader);
    const Sim3 moved = found != after_from_before.end() ? found->second : Sim3();
    correction_of[id] = moved;
    keyframe.camera_from_map = CorrectedPose(keyframe.camera_from_map, moved);
    keyframe.mean_depth *= moved.scale;
    keyframe.depth_sigma *= moved.scale;
  }
  for (PointRecord& record : points_) {
    if (!record.alive) continue;
    const auto moved = correction_of.find(record.point.source_keyframe);
    if (moved == correction_of.end()) continue;
    if (record.point.infinite()) {
      UpdateDirection(&record);
      continue;
    }
    record.point.point_in_map.head<3>() = moved->second * record.point.position();
    record.point.normal = (moved->second.rotation * record.point.normal.cast<double>()).cast<float>();
  }
  AddCorrection(std::move(correction_of));
}

void Map::AddCorrection(std::map<KeyFrameId, Sim3> after_from_before) {
  constexpr std::size_t kMaxCorrections = 8;
  auto correction = std::make_shared<MapCorrection>();
  correction->revision = revision_ + 1;
  correction->after_from_before = std::move(after_from_before);
  corrections_.push_back(std::move(correction));
  if (corrections_.size() > kMaxCorrections) corrections_.erase(corrections_.begin());
}

// Without its reference a panorama map has no position.
void Map::ClosePanorama(PanoramaId id) {
  std::vector<KeyFrameId> dependents;
  for (auto& [keyframe, record] : keyframes_) {
    if (record.keyframe.panorama != id) continue;
    if (record.keyframe.kind == KeyFrameKind::kPanorama) {
      dependents.push_back(keyframe);
    } else {
      record.keyframe.panorama = kNoId;
    }
  }
  for (const KeyFrameId dependent : dependents) RemoveKeyFrame(dependent);
  for (const PointRecord& point : points_) {
    if (point.alive && point.point.panorama == id) RemovePoint(point.point.id);
  }
  std::erase_if(panoramas_, [id](const PanoramaMap& panorama) { return panorama.id == id; });
}

PanoramaId Map::OpenPanorama(KeyFrameId reference) {
  KeyFrame& keyframe = FindKeyFrame(reference)->keyframe;
  const PanoramaId before = keyframe.panorama;
  const PanoramaId id = next_panorama_++;
  keyframe.kind = KeyFrameKind::kSixDof;
  keyframe.panorama = id;
  panoramas_.push_back({id, reference});
  if (before == kNoId) return id;
  for (PointRecord& record : points_) {
    if (!record.alive || record.point.panorama != before || record.point.source_keyframe != reference)
      continue;
    record.point.panorama = id;
    // Other keyframes observed them from another centre.
    const std::vector<KeyFrameId> observers = record.observers;
    for (const KeyFrameId observer : observers) {
      if (observer != reference) RemoveObservation(observer, record.point.id);
    }
    UpdateDirection(&record);
  }
  // It no longer observes the other points of the panorama map that it left.
  const std::vector<Observation> observations = FindKeyFrame(reference)->observations;
  for (const Observation& observation : observations) {
    const PointRecord* point = FindPoint(observation.point);
    if (point && point->point.panorama == before) RemoveObservation(reference, observation.point);
  }
  return id;
}

void Map::SetReference(PanoramaId panorama, KeyFrameId reference) {
  for (PanoramaMap& known : panoramas_) {
    if (known.id != panorama) continue;
    FindKeyFrame(known.reference)->keyframe.kind = KeyFrameKind::kPanorama;
    known.reference = reference;
  }
  KeyFrame& keyframe = FindKeyFrame(reference)->keyframe;
  keyframe.kind = KeyFrameKind::kSixDof;
  keyframe.panorama = panorama;
}

void Map::MakeFinite(PointRecord* record, const Eigen::Vector3d& position) {
  record->point.point_in_map << position, 1.0;
  record->point.panorama = kNoId;
  record->point.was_infinite = true;
  const std::vector<KeyFrameId> observers = record->observers;
  for (const KeyFrameId observer : observers) {
    KeyFrameRecord& keyframe = keyframes_.at(observer);
    if (keyframe.keyframe.kind == KeyFrameKind::kSixDof) continue;
    keyframe.observations.erase(FindObservation(keyframe.observations, record->point.id));
    std::erase(record->observers, observer);
  }
}

void Map::UpdateDirection(PointRecord* record) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const KeyFrameId observer : record->observers) {
    KeyFrameRecord& keyframe = keyframes_.at(observer);
    const auto it = FindObservation(keyframe.observations, record->point.id);
    if (it == keyframe.observations.end() || it->point != record->point.id) continue;
    const auto ray = keyframe.keyframe.camera->Unproject(it->pixel.cast<double>());
    if (ray) sum += keyframe.keyframe.camera_from_map.rotation.inverse() * *ray;
  }
  if (sum.norm() < 1e-6) return;
  record->point.point_in_map << sum.normalized(), 0.0;
  record->point.normal = -sum.normalized().cast<float>();
}

void Map::UpdateDepth(KeyFrameRecord* record) {
  std::vector<double> depths;
  depths.reserve(record->observations.size());
  for (const Observation& observation : record->observations) {
    const PointRecord* point = FindPoint(observation.point);
    if (!point || point->point.infinite()) continue;
    const double depth = (record->keyframe.camera_from_map * point->point.position()).z();
    if (depth > 0) depths.push_back(depth);
  }
  if (depths.size() < 4) return;
  const auto median = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), median, depths.end());
  record->keyframe.mean_depth = *median;
  for (double& depth : depths) depth = std::abs(depth - record->keyframe.mean_depth);
  std::nth_element(depths.begin(), median, depths.end());
  record->keyframe.depth_sigma = 1.4826 * *median;
}

void Map::UpdateNormal(PointRecord* record) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const KeyFrameId observer : record->observers) {
    const Rigid3& camera_from_map = keyframes_.at(observer).keyframe.camera_from_map;
    if (record->point.infinite()) {
      sum -= record->point.position();
    } else {
      sum += (camera_from_map.OriginInSource() - record->point.position()).normalized();
    }
  }
  if (sum.norm() > 1e-6) record->point.normal = sum.normalized().cast<float>();
}

std::vector<std::pair<KeyFrameId, int>> Map::Covisible(KeyFrameId id) {
  std::map<KeyFrameId, int> shared;
  const KeyFrameRecord* record = FindKeyFrame(id);
  if (!record) return {};
  for (const Observation& observation : record->observations) {
    const PointRecord* point = FindPoint(observation.point);
    if (!point || point->point.infinite()) continue;
    for (const KeyFrameId observer : point->observers) {
      if (observer != id) ++shared[observer];
    }
  }
  std::vector<std::pair<KeyFrameId, int>> sorted(shared.begin(), shared.end());
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  return sorted;
}

std::shared_ptr<const MapSnapshot> Map::Snapshot() {
  if (std::erase_if(points_, [](const PointRecord& record) { return !record.alive; }) > 0) {
    point_ids_.clear();
    for (const PointRecord& record : points_) point_ids_.push_back(record.point.id);
  }
  auto snapshot = std::make_shared<MapSnapshot>();
  snapshot->revision = ++revision_;
  snapshot->first_unadjusted = first_unadjusted_;
  snapshot->next_keyframe = next_keyframe_;
  snapshot->next_point = next_point_;
  snapshot->next_panorama = next_panorama_;
  snapshot->panoramas = panoramas_;
  snapshot->corrections = corrections_;
  snapshot->keyframes.reserve(keyframes_.size());
  std::size_t observations = 0;
  for (const auto& [id, record] : keyframes_) observations += record.observations.size();
  snapshot->observations.reserve(observations);
  for (const auto& [id, record] : keyframes_) {
    snapshot->keyframes.push_back(record.keyframe);
    snapshot->observations.insert(snapshot->observations.end(), record.observations.begin(),
                                  record.observations.end());
  }
  snapshot->points.reserve(points_.size());
  for (const PointRecord& record : points_) snapshot->points.push_back(record.point);
  return snapshot;
}

std::size_t Map::FinitePoints() const {
  std::size_t finite = 0;
  for (const PointRecord& record : points_) finite += record.alive && !record.point.infinite();
  return finite;
}

}  // namespace docent::engine

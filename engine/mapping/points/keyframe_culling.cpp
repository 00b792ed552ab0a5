// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/points/keyframe_culling.h"

#include <algorithm>
#include <numbers>

#include "engine/base/option_check.h"

namespace docent::engine {

namespace {

const Observation* FindObservation(const Map::KeyFrameRecord& record, MapPointId point) {
  const auto it = std::lower_bound(record.observations.begin(), record.observations.end(), point,
                                   [](const Observation& o, MapPointId wanted) { return o.point < wanted; });
  return it != record.observations.end() && it->point == point ? &*it : nullptr;
}

bool IsRedundant(const KeyFrameCullingOptions& options, const Map::KeyFrameRecord& record, Map* map) {
  int points = 0, known = 0;
  for (const Observation& observation : record.observations) {
    const Map::PointRecord* point = map->FindPoint(observation.point);
    if (!point || point->point.infinite()) continue;
    ++points;
    int observers = 0;
    for (const KeyFrameId other : point->observers) {
      if (other == record.keyframe.id) continue;
      const Observation* seen = FindObservation(*map->FindKeyFrame(other), observation.point);
      if (seen && seen->level <= observation.level && ++observers == options.min_observers) break;
    }
    known += observers == options.min_observers;
  }
  return points > 0 && known >= options.min_redundant_ratio * points;
}

bool HasNeighbour(const KeyFrameCullingOptions& options, const KeyFrame& keyframe, const Map& map) {
  return std::any_of(map.keyframes().begin(), map.keyframes().end(), [&](const auto& entry) {
    const KeyFrame& other = entry.second.keyframe;
    if (other.id == keyframe.id || other.kind == KeyFrameKind::kPanorama) return false;
    const double distance =
        (other.camera_from_map.OriginInSource() - keyframe.camera_from_map.OriginInSource()).norm();
    const double rotation =
        (other.camera_from_map.rotation * keyframe.camera_from_map.rotation.inverse()).Angle();
    return distance <= options.max_distance * keyframe.mean_depth &&
           rotation <= options.max_rotation_deg * std::numbers::pi / 180;
  });
}

}  // namespace

std::optional<std::string> KeyFrameCullingOptions::Validate() const {
  return OptionCheck()
      .Ratio(min_redundant_ratio, "ratio of points of a redundant keyframe")
      .AtLeast(min_observers, 1, "number of observers of a redundant point")
      .AtLeast(min_keyframes, 1, "number of keyframes that are kept")
      .Positive(max_distance, "distance to a redundant keyframe")
      .Positive(max_rotation_deg, "rotation to a redundant keyframe")
      .fault();
}

KeyFrameId FindRedundantKeyFrame(const KeyFrameCullingOptions& options, KeyFrameId newest, Map* map) {
  if (static_cast<int>(map->keyframes().size()) <= options.min_keyframes) return kNoId;
  for (const auto& [id, record] : map->keyframes()) {
    if (id >= newest) break;
    const KeyFrame& keyframe = record.keyframe;
    if (keyframe.fixed || keyframe.kind == KeyFrameKind::kPanorama || keyframe.panorama != kNoId) continue;
    if (HasNeighbour(options, keyframe, *map) && IsRedundant(options, record, map)) return id;
  }
  return kNoId;
}

KeyFrameId FindOldestKeyFrame(KeyFrameId newest, const Map& map) {
  const auto has_dependents = [&map](const KeyFrame& reference) {
    return std::any_of(map.keyframes().begin(), map.keyframes().end(), [&](const auto& entry) {
      const KeyFrame& other = entry.second.keyframe;
      return other.kind == KeyFrameKind::kPanorama && other.panorama == reference.panorama;
    });
  };
  for (const auto& [id, record] : map.keyframes()) {
    const KeyFrame& keyframe = record.keyframe;
    if (keyframe.fixed || id == newest) continue;
    const bool is_reference = keyframe.kind != KeyFrameKind::kPanorama && keyframe.panorama != kNoId;
    if (!is_reference || !has_dependents(keyframe)) return id;
  }
  return kNoId;
}

void CullKeyFrame(KeyFrameId id, Map* map) {
  const Map::KeyFrameRecord* record = map->FindKeyFrame(id);
  if (!record) return;
  const std::vector<Observation> observations = record->observations;
  for (const Observation& observation : observations) {
    Map::PointRecord* point = map->FindPoint(observation.point);
    if (!point || point->point.source_keyframe != id) continue;
    const Observation* finest = nullptr;
    for (const KeyFrameId other : point->observers) {
      if (other == id) continue;
      const Observation* seen = FindObservation(*map->FindKeyFrame(other), observation.point);
      if (seen && (!finest || seen->level < finest->level)) finest = seen;
    }
    if (!finest) continue;  // the point is removed with its only keyframe
    point->point.source_keyframe = finest->keyframe;
    point->point.source_level = finest->level;
    point->point.source_pixel = LevelFromLevelZero(finest->pixel.cast<double>(), finest->level).cast<float>();
  }
  map->RemoveKeyFrame(id);
}

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/bundle/map_assembly.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

namespace docent::engine {

namespace {

MapAssembly Assemble(Map* map, const std::set<KeyFrameId>& free, const std::set<KeyFrameId>& fixed,
                     std::vector<MapPointId> points) {
  MapAssembly assembly;
  assembly.points = std::move(points);
  std::map<KeyFrameId, std::pair<int, const Map::KeyFrameRecord*>> cameras;
  const auto add = [&](KeyFrameId id, bool hold) {
    const Map::KeyFrameRecord* record = map->FindKeyFrame(id);
    cameras[id] = {static_cast<int>(assembly.cameras.size()), record};
    assembly.cameras.push_back(id);
    assembly.problem.cameras.push_back({record->keyframe.camera, record->keyframe.camera_from_map, hold});
  };
  for (const KeyFrameId id : free) add(id, map->FindKeyFrame(id)->keyframe.fixed);
  for (const KeyFrameId id : fixed) add(id, true);
  std::size_t most = 0;
  for (const MapPointId id : assembly.points) most += map->FindPoint(id)->observers.size();
  assembly.problem.points.reserve(assembly.points.size());
  assembly.problem.measurements.reserve(most);
  std::vector<std::pair<int, const Map::KeyFrameRecord*>> observers;
  for (std::size_t i = 0; i < assembly.points.size(); ++i) {
    const Map::PointRecord* record = map->FindPoint(assembly.points[i]);
    assembly.problem.points.push_back({record->point.position(), false});
    observers.clear();
    for (const KeyFrameId id : record->observers)
      if (const auto camera = cameras.find(id); camera != cameras.end()) observers.push_back(camera->second);
    std::sort(observers.begin(), observers.end());
    for (const auto& [camera, keyframe] : observers) {
      const auto observation =
          std::lower_bound(keyframe->observations.begin(), keyframe->observations.end(), assembly.points[i],
                           [](const Observation& before, MapPointId id) { return before.point < id; });
      if (observation == keyframe->observations.end() || observation->point != assembly.points[i]) continue;
      assembly.problem.measurements.push_back({camera, static_cast<int>(i), observation->pixel,
                                               static_cast<float>(1 << observation->level), false});
    }
  }
  return assembly;
}

// In ascending order of id.
std::vector<MapPointId> FinitePointsSeenBy(Map* map, const std::set<KeyFrameId>& keyframes) {
  std::vector<MapPointId> points;
  for (const KeyFrameId id : keyframes)
    for (const Observation& observation : map->FindKeyFrame(id)->observations)
      points.push_back(observation.point);
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  std::erase_if(points, [&](MapPointId id) {
    const Map::PointRecord* record = map->FindPoint(id);
    return !record || record->point.infinite();
  });
  points.shrink_to_fit();
  return points;
}

}  // namespace

std::set<KeyFrameId> KeyFramesAround(int window, KeyFrameId keyframe, Map* map) {
  std::set<KeyFrameId> keyframes = {keyframe};
  for (const auto& [id, shared] : map->Covisible(keyframe)) {
    if (static_cast<int>(keyframes.size()) > window) break;
    keyframes.insert(id);
  }
  return keyframes;
}

MapAssembly AssembleAround(int window, int max_fixed, KeyFrameId keyframe, Map* map) {
  const std::set<KeyFrameId> free = KeyFramesAround(window, keyframe, map);
  std::vector<MapPointId> points = FinitePointsSeenBy(map, free);
  std::map<KeyFrameId, int> others;
  for (const MapPointId id : points) {
    for (const KeyFrameId observer : map->FindPoint(id)->observers) {
      if (!free.contains(observer)) ++others[observer];
    }
  }
  std::vector<std::pair<int, KeyFrameId>> by_count;
  for (const auto& [id, count] : others) by_count.emplace_back(-count, id);
  std::sort(by_count.begin(), by_count.end());
  std::set<KeyFrameId> fixed;
  for (const auto& [count, id] : by_count) {
    if (static_cast<int>(fixed.size()) >= max_fixed) break;
    fixed.insert(id);
  }
  return Assemble(map, free, fixed, std::move(points));
}

MapAssembly AssembleAll(Map* map) {
  std::set<KeyFrameId> all;
  for (const auto& [id, record] : map->keyframes()) {
    if (record.keyframe.kind == KeyFrameKind::kSixDof) all.insert(id);
  }
  return Assemble(map, all, {}, FinitePointsSeenBy(map, all));
}

}  // namespace docent::engine

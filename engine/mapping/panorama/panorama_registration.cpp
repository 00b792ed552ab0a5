// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/panorama/panorama_registration.h"

namespace docent::engine {

PanoramaRegistration::PanoramaRegistration(const Map& map) {
  for (const PanoramaMap& panorama : map.panoramas()) {
    reference_from_map_[panorama.id] = map.keyframes().at(panorama.reference).keyframe.camera_from_map;
  }
}

void PanoramaRegistration::Follow(Map* map) const {
  // after_from_before keeps every point at the same place relative to the keyframe.
  std::map<PanoramaId, Rigid3> after_from_before;
  for (const PanoramaMap& panorama : map->panoramas()) {
    const auto before = reference_from_map_.find(panorama.id);
    if (before == reference_from_map_.end()) continue;
    const Rigid3& after = map->FindKeyFrame(panorama.reference)->keyframe.camera_from_map;
    // If the reference did not move, the points stay bitwise equal.
    if (after.translation == before->second.translation &&
        after.rotation.quaternion().coeffs() == before->second.rotation.quaternion().coeffs())
      continue;
    after_from_before[panorama.id] = after.inverse() * before->second;
  }
  if (after_from_before.empty()) return;
  for (auto& [id, record] : map->keyframes()) {
    KeyFrame& keyframe = record.keyframe;
    if (keyframe.kind != KeyFrameKind::kPanorama) continue;
    const auto moved = after_from_before.find(keyframe.panorama);
    if (moved == after_from_before.end()) continue;
    keyframe.camera_from_map = keyframe.camera_from_map * moved->second.inverse();
  }
  for (Map::PointRecord& record : map->points()) {
    if (record.alive && record.point.infinite() && after_from_before.contains(record.point.panorama))
      map->UpdateDirection(&record);
  }
}

}  // namespace docent::engine

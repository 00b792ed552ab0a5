// SPDX-License-Identifier: Apache-2.0
// Starting the mapper's map: from two views with depth, or from one view that gives only infinite points.
#include <algorithm>
#include <utility>

#include "engine/mapping/mapper.h"

namespace docent::engine {

void Mapper::StartMap(const InitialPair& pair) {
  // A map of infinite points only is extended by depth; any other map is replaced.
  const bool panorama = !map_.panoramas().empty() && !IsFinite();
  const Map before = panorama ? map_ : Map();
  if (!panorama) map_ = Map();
  searcher_.Clear();
  descriptors_.Clear();
  to_match_.clear();
  to_convert_.clear();
  loops_.Reset();
  lens_estimation_.Reset();
  keyframes_since_global_ = 0;
  const double scale = pair.baseline_m > 0 ? pair.baseline_m : options_.initial_baseline_m;
  Rigid3 b_from_a = pair.geometry.b_from_a;
  b_from_a.translation *= scale / b_from_a.translation.norm();

  // The first view may be a keyframe already. From now on it defines the coordinate frame of the map.
  KeyFrameId a = kNoId;
  for (auto& [id, record] : map_.keyframes()) {
    record.keyframe.fixed = false;
    if (record.keyframe.time == pair.a.time) a = id;
  }
  KeyFrame view;
  view.camera = lens_estimation_.CurrentModel(pair.camera);
  view.camera_from_map = pair.a_from_map;
  view.time = pair.a.time;
  view.features = pair.a.features;
  if (a == kNoId) a = map_.AddKeyFrame(view).keyframe.id;
  map_.FindKeyFrame(a)->keyframe.fixed = true;
  if (panorama) {
    const KeyFrameId first = map_.panoramas().front().reference;
    map_.SetReference(map_.panoramas().front().id, a);
    if (first != a) to_localize_.push_back({first});
  }
  const Rigid3 map_from_a = map_.FindKeyFrame(a)->keyframe.camera_from_map.inverse();
  view.time = pair.b.time;
  view.features = pair.b.features;
  view.camera_from_map = b_from_a * map_from_a.inverse();
  const KeyFrameId b = map_.AddKeyFrame(view).keyframe.id;
  for (std::size_t i = 0; i < pair.matches.size(); ++i) {
    if (!pair.geometry.inlier[i]) continue;
    const InitialPair::Match& match = pair.matches[i];
    MapPoint point;
    point.point_in_map << map_from_a * Eigen::Vector3d(scale * pair.geometry.points_in_a[i]), 1.0;
    point.source_keyframe = a;
    point.source_level = match.level;
    point.source_pixel = LevelFromLevelZero(match.pixel_a.cast<double>(), match.level).cast<float>();
    const MapPointId id = map_.AddPoint(point);
    map_.AddObservation({a, id, match.pixel_a, match.level});
    map_.AddObservation({b, id, match.pixel_b, match.level});
    map_.UpdateNormal(map_.FindPoint(id));
  }
  newest_ = b;
  AdjustGlobally(options_.adjustment, nullptr, &map_);
  for (auto& [id, record] : map_.keyframes()) map_.UpdateDepth(&record);
  // The initial corners are few, so more points are created at once, from both sides.
  CreatePoints(options_.creation, b, a, &map_, &searcher_);
  CreatePoints(options_.creation, a, b, &map_, &searcher_);
  AdjustGlobally(options_.adjustment, nullptr, &map_);
  const std::size_t finite_points = CountFinite();
  if (static_cast<int>(finite_points) < options_.min_initial_points) {
    AddEvent(pair.b.time, MapperEvent::StartFailed{finite_points});
    map_ = before;
    searcher_.Clear();
    newest_ = kNoId;
    if (panorama) return;  // the published panorama map stays
    const std::lock_guard lock(mutex_);
    snapshot_.reset();
    return;
  }
  RemoveDuplicateInfinitePoints(a, &map_);
  if (panorama) to_convert_.emplace_back(a, b);
  locally_adjusted_ = true;
  Publish();
  AddEvent(pair.b.time, MapperEvent::MapStarted{finite_points});
}

// A map without finite points: its first keyframe is the reference of a panorama map, at the origin.
void Mapper::StartFromPanorama(const KeyFrameCandidate& candidate) {
  KeyFrame keyframe;
  keyframe.fixed = true;
  keyframe.time = candidate.time;
  keyframe.camera = candidate.camera;
  keyframe.features = candidate.features;
  const KeyFrameId id = map_.AddKeyFrame(keyframe).keyframe.id;
  map_.OpenPanorama(id);
  const int rays = AddInfinitePoints(options_.infinite, id, {}, &map_);
  if (rays < options_.min_initial_directions) {
    map_ = Map();  // the image is too dark or has too little texture; the next one may be better
    return;
  }
  newest_ = id;
  Publish();
  AddEvent(candidate.time, MapperEvent::PanoramaOpened{rays});
}

}  // namespace docent::engine

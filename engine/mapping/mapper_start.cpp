// SPDX-License-Identifier: Apache-2.0
// How the mapper's map begins: with two views that have depth, or with one that shows directions alone.
#include <algorithm>
#include <string>
#include <utility>

#include "engine/mapping/mapper.h"

namespace docent::engine {

void Mapper::StartMap(const InitialPair& pair) {
  // A map of directions alone gains depth; any other is begun anew.
  const bool panorama = !map_.panoramas().empty() && !IsFinite();
  const Map before = panorama ? map_ : Map();
  if (!panorama) map_ = Map();
  searcher_.Clear();
  descriptors_.Clear();
  to_match_.clear();
  to_convert_.clear();
  loops_.Begin();
  keyframes_since_global_ = 0;
  const double scale = pair.baseline_m > 0 ? pair.baseline_m : options_.initial_baseline_m;
  Rigid3 b_from_a = pair.geometry.b_from_a;
  b_from_a.translation *= scale / b_from_a.translation.norm();

  // The first view may be a keyframe already; and it holds the map's frame from now on.
  KeyFrameId a = kNoId;
  for (auto& [id, record] : map_.keyframes()) {
    record.keyframe.fixed = false;
    if (record.keyframe.time == pair.a.time) a = id;
  }
  KeyFrame view;
  view.camera = pair.camera;
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
  // The first corners are few; the rest of the image joins at once, from both sides.
  CreatePoints(options_.creation, b, a, &map_, &searcher_);
  CreatePoints(options_.creation, a, b, &map_, &searcher_);
  AdjustGlobally(options_.adjustment, nullptr, &map_);
  const auto agreeing =
      std::count_if(map_.points().begin(), map_.points().end(),
                    [](const Map::PointRecord& record) { return record.alive && !record.point.infinite(); });
  if (agreeing < options_.min_initial_points) {
    Tell(MapperEvent::Kind::kStartFailed, pair.b.time, "only " + std::to_string(agreeing) + " points agree");
    map_ = before;
    searcher_.Clear();
    newest_ = kNoId;
    if (panorama) return;  // what was published goes on
    const std::lock_guard lock(mutex_);
    snapshot_.reset();
    return;
  }
  DropInfiniteTwins(a, &map_);
  if (panorama) to_convert_.emplace_back(a, b);
  locally_adjusted_ = true;
  Publish();
  Tell(MapperEvent::Kind::kMapStarted, pair.b.time, std::to_string(agreeing) + " points");
}

// A map without depth yet: its first keyframe is the reference of a panorama map, and stands at the origin.
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
    map_ = Map();  // a dark or empty image; the next one may be better
    return;
  }
  newest_ = id;
  Publish();
  Tell(MapperEvent::Kind::kPanoramaOpened, candidate.time, std::to_string(rays) + " directions");
}

}  // namespace docent::engine

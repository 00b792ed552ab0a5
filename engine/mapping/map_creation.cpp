// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/map_creation.h"

#include <opencv2/core.hpp>

namespace docent::engine {

namespace {

bool ShowSameImage(const ImageFeatures& a, const ImageFeatures& b) {
  const cv::Mat &first = a.small_blurry.pixels, &second = b.small_blurry.pixels;
  return first.size() == second.size() && cv::norm(first, second, cv::NORM_INF) == 0;
}

}  // namespace

void MapCreation::CreateFromPair(const InitialPair& pair) {
  Map& map = workspace_->map;
  const bool extends = !map.panoramas().empty() && map.FinitePoints() == 0;
  const Map before = extends ? map : Map();
  workspace_->Reset(before);
  refinement_->Forget();
  panoramas_->Reset();
  loops_->Reset();
  lens_estimation_->Reset();
  const double scale = pair.baseline_m > 0 ? pair.baseline_m : options_.initial_baseline;
  const Views views = AddViews(pair, scale);
  AddMatchedPoints(pair, scale, views);
  AdjustGlobally(options_.adjustment, nullptr, &map);
  for (auto& [id, record] : map.keyframes()) map.UpdateDepth(&record);
  // The initial corners are few, so more points are created at once, from both sides.
  CreatePoints(options_.creation, views.b, views.a, &map, &workspace_->searcher);
  CreatePoints(options_.creation, views.a, views.b, &map, &workspace_->searcher);
  AdjustGlobally(options_.adjustment, nullptr, &map);
  const std::size_t finite_points = map.FinitePoints();
  if (static_cast<int>(finite_points) < options_.min_initial_points) {
    output_->AddEvent(pair.b.time, MapperEvent::StartFailed{finite_points});
    workspace_->Reset(before);
    refinement_->SetNewest(kNoId);
    if (!extends) output_->Publish(nullptr);
    return;
  }
  refinement_->SetNewest(views.b);
  refinement_->SetReadoutPrior(pair.readout, pair.camera);
  if (refinement_->UpdateReadout()) AdjustGlobally(options_.adjustment, nullptr, &map);
  RemoveDuplicateInfinitePoints(views.a, &map);
  if (extends) panoramas_->PlanConversion(views.a, views.b);
  refinement_->SetLocallyAdjusted();
  output_->Publish(map.Snapshot());
  output_->AddEvent(pair.b.time, MapperEvent::MapStarted{finite_points});
}

KeyFrameId MapCreation::AddFirstView(const InitialPair& pair) {
  Map& map = workspace_->map;
  KeyFrameId a = kNoId;
  // Another camera, or an earlier session, may have a keyframe of the same time.
  const auto lens = lens_estimation_->CurrentModel(pair.a.camera ? pair.a.camera : pair.camera);
  for (auto& [id, record] : map.keyframes()) {
    record.keyframe.fixed = false;
    if (record.keyframe.time == pair.a.time && ShowSameImage(*record.keyframe.features, *pair.a.features) &&
        lens_estimation_->CurrentModel(record.keyframe.camera)->HasSameLens(*lens))
      a = id;
  }
  if (a == kNoId) {
    KeyFrame view;
    view.camera = lens_estimation_->CurrentModel(pair.camera);
    view.camera_from_map = pair.a_from_map;
    view.time = pair.a.time;
    view.features = pair.a.features;
    a = map.AddKeyFrame(view).keyframe.id;
  }
  KeyFrame& first = map.FindKeyFrame(a)->keyframe;
  // When the first image became a keyframe, it was not known yet how the camera would move.
  if (pair.a.camera) first.camera = lens_estimation_->CurrentModel(pair.a.camera);
  first.fixed = true;
  if (map.panoramas().empty()) return a;
  const PanoramaMap panorama = map.panoramas().front();
  map.SetReference(panorama.id, a);
  if (panorama.reference != a) panoramas_->AddUnlocalized(panorama.reference);
  return a;
}

MapCreation::Views MapCreation::AddViews(const InitialPair& pair, double scale) {
  Map& map = workspace_->map;
  const KeyFrameId a = AddFirstView(pair);
  Rigid3 b_from_a = pair.geometry.b_from_a;
  b_from_a.translation *= scale / b_from_a.translation.norm();
  KeyFrame view;
  view.camera = lens_estimation_->CurrentModel(pair.b.camera ? pair.b.camera : pair.camera);
  view.time = pair.b.time;
  view.features = pair.b.features;
  const Rigid3 map_from_a = map.FindKeyFrame(a)->keyframe.camera_from_map.inverse();
  view.camera_from_map = b_from_a * map_from_a.inverse();
  return {a, map.AddKeyFrame(view).keyframe.id};
}

void MapCreation::AddMatchedPoints(const InitialPair& pair, double scale, const Views& views) {
  Map& map = workspace_->map;
  const Rigid3 map_from_a = map.FindKeyFrame(views.a)->keyframe.camera_from_map.inverse();
  for (std::size_t i = 0; i < pair.matches.size(); ++i) {
    if (!pair.geometry.inlier[i]) continue;
    const InitialPair::Match& match = pair.matches[i];
    MapPoint point;
    point.point_in_map << map_from_a * Eigen::Vector3d(scale * pair.geometry.points_in_a[i]), 1.0;
    point.source_keyframe = views.a;
    point.source_level = match.level;
    point.source_pixel = LevelFromLevelZero(match.pixel_a.cast<double>(), match.level).cast<float>();
    const MapPointId id = map.AddPoint(point);
    map.AddObservation({views.a, id, match.pixel_a, match.level});
    map.AddObservation({views.b, id, match.pixel_b, match.level});
    map.UpdateNormal(map.FindPoint(id));
  }
}

void MapCreation::CreateFromPanorama(const KeyFrameCandidate& candidate) {
  Map& map = workspace_->map;
  KeyFrame keyframe;
  keyframe.fixed = true;
  keyframe.time = candidate.time;
  keyframe.camera = lens_estimation_->CurrentModel(candidate.camera);
  keyframe.features = candidate.features;
  const KeyFrameId id = map.AddKeyFrame(keyframe).keyframe.id;
  map.OpenPanorama(id);
  const int rays = AddInfinitePoints(options_.infinite, id, {}, &map);
  if (rays < options_.min_initial_directions) {
    map = Map();  // the next image may be better
    return;
  }
  refinement_->SetNewest(id);
  output_->Publish(map.Snapshot());
  output_->AddEvent(candidate.time, MapperEvent::PanoramaOpened{rays});
}

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/panorama_mapper.h"

#include <algorithm>

namespace docent::engine {

void PanoramaMapper::Reset() {
  to_localize_.clear();
  to_convert_.clear();
  for (const auto& [id, record] : workspace_->map.keyframes()) {
    if (record.keyframe.kind == KeyFrameKind::kPanorama) to_localize_.push_back({id});
  }
}

void PanoramaMapper::Insert(const KeyFrameCandidate& candidate) {
  Map& map = workspace_->map;
  const auto panorama =
      std::find_if(map.panoramas().begin(), map.panoramas().end(),
                   [&](const PanoramaMap& known) { return known.id == candidate.panorama; });
  if (panorama == map.panoramas().end()) return;
  const KeyFrame& reference = map.FindKeyFrame(panorama->reference)->keyframe;
  KeyFrame keyframe;
  keyframe.kind = KeyFrameKind::kPanorama;
  keyframe.panorama = candidate.panorama;
  keyframe.time = candidate.time;
  keyframe.camera = candidate.camera;
  keyframe.features = candidate.features;
  // The true position of the camera is unknown (hybrid-slam §2). It is near the centre of the reference, up
  // to the displacement that rotating a hand-held camera causes.
  keyframe.camera_from_map = candidate.camera_from_map;
  keyframe.mean_depth = reference.mean_depth;
  keyframe.depth_sigma = reference.depth_sigma;
  const KeyFrameId id = map.AddKeyFrame(keyframe).keyframe.id;
  std::vector<Eigen::Vector2f> taken;
  for (const PointMatch& match : candidate.matches) {
    const Map::PointRecord* point = map.FindPoint(match.point);
    if (!point) continue;
    if (!point->point.infinite()) {
      taken.push_back(match.pixel);
    } else if (point->point.panorama == candidate.panorama) {
      map.AddObservation({id, match.point, match.pixel, match.level});
    }
  }
  const int rays = AddInfinitePoints(options_.infinite, id, taken, &map);
  RemoveInfiniteOutliers(candidate.panorama, &map);
  to_localize_.push_back({id});
  output_->Publish(map.Snapshot());
  output_->AddEvent(candidate.time, MapperEvent::PanoramaKeyFrameAdded{rays});
}

void PanoramaMapper::TryToLocalize(Unlocalized* waiting, std::size_t finite) {
  waiting->tried_with_points = finite;
  waiting->appearance_due = !Localize(waiting->keyframe, nullptr);
}

bool PanoramaMapper::LocalizeNew() {
  if (to_localize_.empty()) return false;
  std::erase_if(to_localize_, [&](const Unlocalized& waiting) {
    const Map::KeyFrameRecord* record = workspace_->map.FindKeyFrame(waiting.keyframe);
    return !record || record->keyframe.kind != KeyFrameKind::kPanorama;
  });
  const auto fresh = std::find_if(to_localize_.begin(), to_localize_.end(),
                                  [](const Unlocalized& waiting) { return waiting.tried_with_points == 0; });
  if (fresh == to_localize_.end()) return false;
  const std::size_t finite = workspace_->map.FinitePoints();
  if (finite == 0) return false;
  TryToLocalize(&*fresh, finite);
  return true;
}

bool PanoramaMapper::LocalizeAgain() {
  Map& map = workspace_->map;
  if (to_localize_.empty()) return false;
  // Localization is retried when the number of finite points has grown by this factor.
  constexpr double kGrowth = 1.1;
  const std::size_t finite = map.FinitePoints();
  for (Unlocalized& waiting : to_localize_) {
    if (static_cast<double>(finite) < kGrowth * static_cast<double>(waiting.tried_with_points) + 1) continue;
    TryToLocalize(&waiting, finite);
    return true;
  }
  // If guided search failed, the pose may be too far off; matching descriptors does not depend on it.
  const auto due = std::find_if(to_localize_.begin(), to_localize_.end(),
                                [](const Unlocalized& waiting) { return waiting.appearance_due; });
  if (due == to_localize_.end()) return false;
  if (workspace_->descriptors.UpdateOne(options_.appearance, &map)) return true;
  due->appearance_due = false;
  const KeyFrameId id = due->keyframe;
  const auto guess =
      workspace_->descriptors.SuggestPose(options_.appearance, map.FindKeyFrame(id)->keyframe, id + 1, &map);
  if (guess) Localize(id, &*guess);
  return true;
}

bool PanoramaMapper::Localize(KeyFrameId id, const Rigid3* guess) {
  Map& map = workspace_->map;
  if (!LocalizePanoramaKeyFrame(options_.localization, id, id + 1, &map, &workspace_->searcher, guess))
    return false;
  PlanConversions(id);
  refinement_->AddLocalized(id);
  loops_->Enqueue(id);
  output_->Publish(map.Snapshot());
  output_->AddEvent(map.FindKeyFrame(id)->keyframe.time,
                    MapperEvent::KeyFrameLocalized{id, guess != nullptr});
  return true;
}

void PanoramaMapper::PlanConversions(KeyFrameId id) {
  // Pairs of this keyframe with others that have a similar orientation and a sufficient baseline.
  constexpr double kMaxRotation = 0.8;  // radians
  const KeyFrame& keyframe = workspace_->map.FindKeyFrame(id)->keyframe;
  const Eigen::Vector3d center = keyframe.camera_from_map.OriginInSource();
  std::vector<std::pair<double, std::pair<KeyFrameId, KeyFrameId>>> pairs;
  for (const auto& [other, record] : workspace_->map.keyframes()) {
    if (other == id || record.keyframe.kind == KeyFrameKind::kPanorama) continue;
    const double depth = std::min(record.keyframe.mean_depth, keyframe.mean_depth);
    const double baseline = (record.keyframe.camera_from_map.OriginInSource() - center).norm() / depth;
    if (baseline < options_.min_neighbour_baseline || baseline > 2 * options_.max_neighbour_baseline)
      continue;
    const double rotation =
        (keyframe.camera_from_map.rotation * record.keyframe.camera_from_map.rotation.inverse()).Angle();
    if (rotation > kMaxRotation) continue;
    if (record.keyframe.panorama != kNoId) pairs.push_back({rotation, {other, id}});
    if (keyframe.panorama != kNoId) pairs.push_back({rotation, {id, other}});
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  const auto wanted = static_cast<std::size_t>(options_.conversion_neighbours);
  for (std::size_t i = 0; i < pairs.size() && i < wanted; ++i) to_convert_.push_back(pairs[i].second);
}

bool PanoramaMapper::ConvertOne() {
  Map& map = workspace_->map;
  if (to_convert_.empty()) return false;
  const auto [reference, partner] = to_convert_.front();
  to_convert_.pop_front();
  PointCreationOptions creation = options_.creation;
  creation.min_parallax_deg = options_.min_infinite_parallax_deg;
  const InfiniteConversion conversion =
      ConvertInfinitePoints(creation, reference, partner, &map, &workspace_->searcher);
  if (conversion.converted.empty() && conversion.merged == 0) return true;
  refinement_->AddPoints(conversion.converted);
  output_->Publish(map.Snapshot());
  output_->AddEvent(map.FindKeyFrame(partner)->keyframe.time,
                    MapperEvent::InfinitePointsTriangulated{conversion.converted.size(), conversion.merged});
  return true;
}

}  // namespace docent::engine

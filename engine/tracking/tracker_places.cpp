// SPDX-License-Identifier: Apache-2.0
// Retrieves candidate places of a lost camera and verifies them (ptamm §3.2, §5.3).
#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/tracking/tracker.h"
#include "engine/vision/rotation_alignment.h"

namespace docent::engine {

namespace {

// Whether two poses in one map are different places and not two estimates of one. `keyframe` is close to one
// of them.
bool IsDifferentPlace(const KeyFrame& keyframe, const Rigid3& camera_from_map, const Rigid3& other_from_map) {
  constexpr double kMinDistance = 0.25;  // ratio of the keyframe's median depth
  constexpr double kMinAngle = 0.3;      // radians
  const Rigid3 other_from_camera = other_from_map * camera_from_map.inverse();
  return other_from_camera.translation.norm() > kMinDistance * keyframe.mean_depth ||
         other_from_camera.rotation.Angle() > kMinAngle;
}

}  // namespace

std::optional<Tracker::AlignedPlace> Tracker::AlignPlace(const PlaceCandidate& candidate) const {
  const KeyFrame* keyframe = candidate.map ? candidate.map->FindKeyFrame(candidate.keyframe) : nullptr;
  if (!keyframe) return std::nullopt;
  const auto rotation =
      AlignRotation(keyframe->features->small_blurry, *keyframe->camera, features_->small_blurry, *camera_);
  if (!rotation) return std::nullopt;
  // Dividing by the overlap compensates that small overlaps agree more easily.
  return AlignedPlace{candidate,
                      Rigid3(rotation->b_from_a, Eigen::Vector3d::Zero()) * keyframe->camera_from_map,
                      rotation->rms / std::sqrt(rotation->overlap)};
}

std::vector<Tracker::AlignedPlace> Tracker::BestPlaces(const PlaceFinder& places,
                                                       std::uint64_t excluded_map) const {
  std::vector<AlignedPlace> aligned;
  PlaceQuery query(features_->small_blurry);
  query.places_first = false;  // among several keyframes of one place, the best alignment is the better guess
  const auto found = places.FindPlaces(query, options_.max_retrieved, options_.max_retrieved_per_map, 0);
  if (excluded_map != 0 && (found.empty() || found.front().map_key == excluded_map)) return aligned;
  for (const PlaceCandidate& candidate : found) {
    if (candidate.map_key == excluded_map) continue;
    if (const auto place = AlignPlace(candidate)) aligned.push_back(*place);
  }
  std::stable_sort(aligned.begin(), aligned.end(), [](const AlignedPlace& a, const AlignedPlace& b) {
    return a.alignment_error < b.alignment_error;
  });
  return aligned;
}

std::vector<Tracker::AlignedPlace> Tracker::PlacesByWords(const PlaceFinder& places,
                                                          const std::vector<AlignedPlace>& tried) const {
  std::vector<AlignedPlace> aligned;
  const WordBag words = MakeWordBag(*features_);
  if (words.empty()) return aligned;
  const auto found = places.FindPlaces({features_->small_blurry, words}, options_.max_retrieved,
                                       options_.max_retrieved_per_map, 0);
  for (const PlaceCandidate& candidate : found) {
    if (aligned.size() == options_.max_verified) break;
    const auto known = std::find_if(tried.begin(), tried.end(), [&](const AlignedPlace& place) {
      return place.candidate.map_key == candidate.map_key && place.candidate.keyframe == candidate.keyframe;
    });
    if (known != tried.end()) continue;
    if (const auto place = AlignPlace(candidate)) aligned.push_back(*place);
  }
  return aligned;
}

std::vector<Tracker::AlignedPlace> Tracker::PlacesByDescriptors(const PlaceFinder& places) {
  std::vector<AlignedPlace> suggested;
  // Most keyframes come from one camera: any of them gives the resolution of the descriptors.
  const auto any = places.FindPlaces(features_->small_blurry, 1, 1, map_key_);
  const KeyFrame* keyframe =
      !any.empty() && any.front().map ? any.front().map->FindKeyFrame(any.front().keyframe) : nullptr;
  const DescribedImage image = DescribeAtResolution(
      *features_, *camera_, keyframe ? keyframe->camera->PixelAngle() : camera_->PixelAngle());
  if (image.words.empty()) return suggested;
  PlaceQuery query(features_->small_blurry, image.words);
  query.places_first = false;
  const auto found = places.FindPlaces(query, options_.max_retrieved, options_.max_retrieved, 0);
  for (const auto& suggestion :
       descriptor_relocalizer_.Suggest(image.corners, *camera_, found, random_.Next()))
    suggested.push_back({suggestion.candidate, suggestion.camera_from_map, 0});
  return suggested;
}

MapTrackResult Tracker::VerifyPlace(const AlignedPlace& place, MapTracker* tracker) {
  const PlaceCandidate& candidate = place.candidate;
  const KeyFrame* keyframe = candidate.map->FindKeyFrame(candidate.keyframe);
  tracker->Clear();
  tracker->EnablePanorama(keyframe ? keyframe->panorama : kNoId);
  return tracker->Track(*candidate.map, *features_, place.camera_from_map, MapTracker::Effort::kRecovery,
                        &random_);
}

std::vector<Tracker::VerifiedPlace> Tracker::VerifyPlaces(const PlaceFinder& finder,
                                                          const std::vector<AlignedPlace>& places,
                                                          TrackedFrame* out) {
  std::vector<VerifiedPlace> found;
  std::set<std::uint64_t> tried;
  for (std::size_t i = 0; i < places.size() && i < options_.max_verified && found.empty(); ++i) {
    const PlaceCandidate& candidate = places[i].candidate;
    tried.insert(candidate.map_key);
    const MapTrackResult result = VerifyPlace(places[i], &competing_tracker_);
    const RejectionReason rejection = RejectionReasonOf(result, *candidate.map);
    out->relocalization.Consider(
        {.rejection = rejection, .map_key = candidate.map_key, .inliers = result.inliers});
    if (rejection == RejectionReason::kNone)
      found.push_back({places[i], result, competing_tracker_.panorama()});
  }
  if (found.empty()) return found;
  const bool ahead_in_map = ReplaceByBetterPlace(finder, &found.front(), out);
  const double quality = found.front().result.Quality();
  auto competitor = BestCompetingMap(places, std::move(tried), out);
  if (!ahead_in_map &&
      !(competitor && competitor->result.Quality() >= options_.min_quality_ratio * quality)) {
    const std::uint64_t key = found.front().place.candidate.map_key;
    out->relocalization = {.rejection = RejectionReason::kAmbiguous,
                           .map_key = key,
                           .competitor_key = key,
                           .inliers = found.front().result.inliers};
    return {};
  }
  if (competitor) found.push_back(std::move(*competitor));
  std::stable_sort(found.begin(), found.end(), [](const VerifiedPlace& a, const VerifiedPlace& b) {
    return a.result.Quality() > b.result.Quality();
  });
  return found;
}

// One map may contain several places of similar appearance.
bool Tracker::ReplaceByBetterPlace(const PlaceFinder& finder, VerifiedPlace* found, TrackedFrame* out) {
  const PlaceCandidate& here = found->place.candidate;
  auto elsewhere = BestElsewhere(finder, here.map_key, found->result.camera_from_map, here.keyframe, out);
  if (!elsewhere) return true;
  if (elsewhere->result.Quality() > found->result.Quality()) std::swap(*found, *elsewhere);
  return found->result.Quality() >= options_.min_quality_ratio * elsewhere->result.Quality();
}

std::optional<Tracker::VerifiedPlace> Tracker::BestElsewhere(const PlaceFinder& finder, std::uint64_t map_key,
                                                             const Rigid3& camera_from_map,
                                                             KeyFrameId excluded_keyframe,
                                                             TrackedFrame* out) {
  const WordBag words = MakeWordBag(*features_);
  const auto retrieved = finder.FindPlaces({features_->small_blurry, words}, options_.max_retrieved,
                                           options_.max_retrieved_per_map, map_key);
  std::optional<VerifiedPlace> best;
  std::size_t tried = 0;
  for (const PlaceCandidate& candidate : retrieved) {
    if (tried == options_.max_verified) break;
    if (candidate.keyframe == excluded_keyframe) continue;
    const auto place = AlignPlace(candidate);
    if (!place) continue;
    ++tried;
    const MapTrackResult other = VerifyPlace(*place, &competing_tracker_);
    const RejectionReason rejection = RejectionReasonOf(other, *candidate.map);
    out->relocalization.Consider({.rejection = rejection, .map_key = map_key, .inliers = other.inliers});
    if (rejection != RejectionReason::kNone || (best && other.Quality() <= best->result.Quality())) continue;
    if (IsDifferentPlace(*candidate.map->FindKeyFrame(candidate.keyframe), other.camera_from_map,
                         camera_from_map))
      best = VerifiedPlace{*place, other, competing_tracker_.panorama()};
  }
  return best;
}

std::optional<Tracker::VerifiedPlace> Tracker::BestCompetingMap(const std::vector<AlignedPlace>& places,
                                                                std::set<std::uint64_t> excluded_maps,
                                                                TrackedFrame* out) {
  std::optional<VerifiedPlace> best;
  std::size_t competing_maps = 0;
  for (const AlignedPlace& place : places) {
    if (competing_maps == options_.max_competing_maps) break;
    if (!excluded_maps.insert(place.candidate.map_key).second) continue;
    ++competing_maps;
    const MapTrackResult result = VerifyPlace(place, &competing_tracker_);
    const RejectionReason rejection = RejectionReasonOf(result, *place.candidate.map);
    out->relocalization.Consider(
        {.rejection = rejection, .map_key = place.candidate.map_key, .inliers = result.inliers});
    if (rejection == RejectionReason::kNone && (!best || result.Quality() > best->result.Quality()))
      best = VerifiedPlace{place, result, competing_tracker_.panorama()};
  }
  return best;
}

}  // namespace docent::engine

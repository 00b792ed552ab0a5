// SPDX-License-Identifier: Apache-2.0
// How a lost tracker finds the places that its image may be of, and which of them it is (ptamm §3.2, §5.3).
#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/tracking/tracker.h"
#include "engine/vision/rotation_alignment.h"

namespace docent::engine {

namespace {

// Two poses in one map that cannot be the same one told twice. `keyframe` is near one of them.
bool IsElsewhere(const KeyFrame& keyframe, const Rigid3& camera_from_map, const Rigid3& other_from_map) {
  constexpr double kFar = 0.25;    // times the depth of what is seen
  constexpr double kTurned = 0.3;  // radians
  const Rigid3 other_from_camera = other_from_map * camera_from_map.inverse();
  return other_from_camera.translation.norm() > kFar * keyframe.mean_depth ||
         other_from_camera.rotation.Angle() > kTurned;
}

}  // namespace

std::optional<Tracker::AlignedPlace> Tracker::AlignPlace(const PlaceCandidate& candidate) const {
  const KeyFrame* keyframe = candidate.map ? candidate.map->FindKeyFrame(candidate.keyframe) : nullptr;
  if (!keyframe) return std::nullopt;
  const auto rotation =
      AlignRotation(keyframe->features->small_blurry, *keyframe->camera, features_->small_blurry, *camera_);
  if (!rotation) return std::nullopt;
  // What overlaps little agrees easily.
  return AlignedPlace{candidate,
                      Rigid3(rotation->b_from_a, Eigen::Vector3d::Zero()) * keyframe->camera_from_map,
                      rotation->rms / std::sqrt(rotation->overlap)};
}

std::vector<Tracker::AlignedPlace> Tracker::BestPlaces(const PlaceFinder& places,
                                                       std::uint64_t but_map) const {
  std::vector<AlignedPlace> turned;
  PlaceQuery query(features_->small_blurry);
  query.places_first = false;  // the one that fits best of some that are near each other is a better guess
  const auto found = places.FindPlaces(query, options_.max_retrieved, options_.max_retrieved_per_map, 0);
  if (but_map != 0 && (found.empty() || found.front().map_key == but_map)) return turned;
  for (const PlaceCandidate& candidate : found) {
    if (candidate.map_key == but_map) continue;
    if (const auto place = AlignPlace(candidate)) turned.push_back(*place);
  }
  std::stable_sort(turned.begin(), turned.end(),
                   [](const AlignedPlace& a, const AlignedPlace& b) { return a.misfit < b.misfit; });
  return turned;
}

std::vector<Tracker::AlignedPlace> Tracker::PlacesByWords(const PlaceFinder& places,
                                                          const std::vector<AlignedPlace>& tried) const {
  std::vector<AlignedPlace> turned;
  const WordBag words = MakeWordBag(*features_);
  if (words.empty()) return turned;
  const auto found = places.FindPlaces({features_->small_blurry, words}, options_.max_retrieved,
                                       options_.max_retrieved_per_map, 0);
  for (const PlaceCandidate& candidate : found) {
    if (turned.size() == options_.candidates) break;
    const auto known = std::find_if(tried.begin(), tried.end(), [&](const AlignedPlace& place) {
      return place.candidate.map_key == candidate.map_key && place.candidate.keyframe == candidate.keyframe;
    });
    if (known != tried.end()) continue;
    if (const auto place = AlignPlace(candidate)) turned.push_back(*place);
  }
  return turned;
}

std::vector<Tracker::AlignedPlace> Tracker::PlacesByDescriptors(const PlaceFinder& places) {
  std::vector<AlignedPlace> suggested;
  // Most keyframes are of one camera: any of them tells the resolution that they were described at.
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

MapTrackResult Tracker::TryPlace(const AlignedPlace& place, MapTracker* tracker) {
  const PlaceCandidate& candidate = place.candidate;
  const KeyFrame* keyframe = candidate.map->FindKeyFrame(candidate.keyframe);
  tracker->Clear();
  tracker->EnablePanorama(keyframe ? keyframe->panorama : kNoId);
  return tracker->Track(*candidate.map, *features_, place.camera_from_map, MapTracker::Effort::kRecovery,
                        &random_);
}

std::vector<Tracker::FoundPlace> Tracker::FindMaps(const PlaceFinder& finder,
                                                   const std::vector<AlignedPlace>& places,
                                                   TrackedFrame* out) {
  std::vector<FoundPlace> found;
  std::set<std::uint64_t> tried;
  for (std::size_t i = 0; i < places.size() && i < options_.candidates && found.empty(); ++i) {
    const PlaceCandidate& candidate = places[i].candidate;
    tried.insert(candidate.map_key);
    const MapTrackResult result = TryPlace(places[i], &competing_tracker_);
    const RejectionReason doubt = RejectionReasonOf(result, *candidate.map);
    out->verdict.Consider({.doubt = doubt, .map_key = candidate.map_key, .inliers = result.inliers});
    if (doubt == RejectionReason::kNone) found.push_back({places[i], result, competing_tracker_.panorama()});
  }
  if (found.empty()) return found;
  const bool ahead_in_map = ReplaceByBetterPlace(finder, &found.front(), out);
  const double quality = found.front().result.Quality();
  auto competitor = BestCompetingMap(places, std::move(tried), out);
  if (!ahead_in_map &&
      !(competitor && competitor->result.Quality() >= options_.min_quality_ratio * quality)) {
    const std::uint64_t key = found.front().place.candidate.map_key;
    out->verdict = {.doubt = RejectionReason::kLookAlikes,
                    .map_key = key,
                    .competitor_key = key,
                    .inliers = found.front().result.inliers};
    return {};
  }
  if (competitor) found.push_back(std::move(*competitor));
  std::stable_sort(found.begin(), found.end(), [](const FoundPlace& a, const FoundPlace& b) {
    return a.result.Quality() > b.result.Quality();
  });
  return found;
}

// A map may hold places that look alike, too.
bool Tracker::ReplaceByBetterPlace(const PlaceFinder& finder, FoundPlace* found, TrackedFrame* out) {
  const PlaceCandidate& here = found->place.candidate;
  auto elsewhere = BestElsewhere(finder, here.map_key, found->result.camera_from_map, here.keyframe, out);
  if (!elsewhere) return true;
  if (elsewhere->result.Quality() > found->result.Quality()) std::swap(*found, *elsewhere);
  return found->result.Quality() >= options_.min_quality_ratio * elsewhere->result.Quality();
}

std::optional<Tracker::FoundPlace> Tracker::BestElsewhere(const PlaceFinder& finder, std::uint64_t map_key,
                                                          const Rigid3& camera_from_map,
                                                          KeyFrameId but_keyframe, TrackedFrame* out) {
  const WordBag words = MakeWordBag(*features_);
  const auto alike = finder.FindPlaces({features_->small_blurry, words}, options_.max_retrieved,
                                       options_.max_retrieved_per_map, map_key);
  std::optional<FoundPlace> best;
  std::size_t tried = 0;
  for (const PlaceCandidate& candidate : alike) {
    if (tried == options_.candidates) break;
    if (candidate.keyframe == but_keyframe) continue;
    const auto place = AlignPlace(candidate);
    if (!place) continue;
    ++tried;
    const MapTrackResult other = TryPlace(*place, &competing_tracker_);
    const RejectionReason doubt = RejectionReasonOf(other, *candidate.map);
    out->verdict.Consider({.doubt = doubt, .map_key = map_key, .inliers = other.inliers});
    if (doubt != RejectionReason::kNone || (best && other.Quality() <= best->result.Quality())) continue;
    if (IsElsewhere(*candidate.map->FindKeyFrame(candidate.keyframe), other.camera_from_map, camera_from_map))
      best = FoundPlace{*place, other, competing_tracker_.panorama()};
  }
  return best;
}

std::optional<Tracker::FoundPlace> Tracker::BestCompetingMap(const std::vector<AlignedPlace>& places,
                                                             std::set<std::uint64_t> but_maps,
                                                             TrackedFrame* out) {
  std::optional<FoundPlace> best;
  std::size_t competing_maps = 0;
  for (const AlignedPlace& place : places) {
    if (competing_maps == options_.competing_maps) break;
    if (!but_maps.insert(place.candidate.map_key).second) continue;
    ++competing_maps;
    const MapTrackResult result = TryPlace(place, &competing_tracker_);
    const RejectionReason doubt = RejectionReasonOf(result, *place.candidate.map);
    out->verdict.Consider({.doubt = doubt, .map_key = place.candidate.map_key, .inliers = result.inliers});
    if (doubt == RejectionReason::kNone && (!best || result.Quality() > best->result.Quality()))
      best = FoundPlace{place, result, competing_tracker_.panorama()};
  }
  return best;
}

}  // namespace docent::engine

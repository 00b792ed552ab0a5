// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/place_verification.h"

#include <algorithm>
#include <utility>

#include "engine/base/stable_sort.h"

namespace docent::engine {

bool AreOfOnePlace(const Rigid3& camera_from_map, const Rigid3& other_from_map, double depth) {
  constexpr double kMaxDistance = 0.25;  // ratio of the depth
  constexpr double kMaxAngle = 0.3;      // radians
  const Rigid3 other_from_camera = other_from_map * camera_from_map.inverse();
  return other_from_camera.translation.norm() <= kMaxDistance * depth &&
         other_from_camera.rotation.Angle() <= kMaxAngle;
}

PlaceVerification::PlaceVerification(const TrackerOptions& options, std::shared_ptr<const CameraModel> camera)
    : options_(options), criteria_(options), tracker_(options.map_tracker, std::move(camera)) {}

VerifiedPlace PlaceVerification::Try(const Query& query, const AlignedPlace& place) {
  const PlaceCandidate& candidate = place.candidate;
  const KeyFrame* keyframe = candidate.map->FindKeyFrame(candidate.keyframe);
  tracker_.SetComparison(query.comparison);
  tracker_.Clear();
  tracker_.EnablePanorama(keyframe ? keyframe->panorama : kNoId);
  const MapTrackResult result = tracker_.Track(*candidate.map, *query.image.features, place.camera_from_map,
                                               MapTracker::Effort::kRelocalization, query.random);
  return {place, result, tracker_.panorama()};
}

MapTrackResult PlaceVerification::Continue(const Query& query, const MapSnapshot& map,
                                           const Rigid3& predicted, PanoramaId panorama) {
  tracker_.SetComparison(query.comparison);
  tracker_.Clear();
  tracker_.EnablePanorama(panorama);
  return tracker_.Track(map, *query.image.features, predicted, MapTracker::Effort::kWide, query.random);
}

std::vector<VerifiedPlace> PlaceVerification::Verify(const Query& query,
                                                     const std::vector<AlignedPlace>& places) {
  std::vector<VerifiedPlace> found;
  std::set<std::uint64_t> tried;
  for (std::size_t i = 0; i < places.size() && i < options_.max_verified && found.empty(); ++i) {
    const PlaceCandidate& candidate = places[i].candidate;
    tried.insert(candidate.map_key);
    VerifiedPlace verified = Try(query, places[i]);
    const RejectionReason rejection =
        criteria_.RejectionReasonOf(verified.result, *candidate.map, query.comparison);
    query.rejection->Consider(
        {.rejection = rejection, .map_key = candidate.map_key, .inliers = verified.result.inliers});
    if (rejection == RejectionReason::kNone) found.push_back(std::move(verified));
  }
  if (found.empty()) return found;
  const bool ahead_in_map = ReplaceByBetterPlace(query, &found.front());
  const double quality = found.front().result.Quality();
  auto competitor = BestCompetingMap(query, places, std::move(tried));
  if (!ahead_in_map &&
      !(competitor && competitor->result.Quality() >= options_.min_quality_ratio * quality)) {
    const std::uint64_t key = found.front().place.candidate.map_key;
    *query.rejection = {.rejection = RejectionReason::kAmbiguous,
                        .map_key = key,
                        .competitor_key = key,
                        .inliers = found.front().result.inliers};
    return {};
  }
  if (competitor) found.push_back(std::move(*competitor));
  StableSort(&found, [](const VerifiedPlace& a, const VerifiedPlace& b) {
    return a.result.Quality() > b.result.Quality();
  });
  return found;
}

// One map may contain several places of similar appearance.
bool PlaceVerification::ReplaceByBetterPlace(const Query& query, VerifiedPlace* found) {
  const PlaceCandidate& here = found->place.candidate;
  auto elsewhere = BestElsewhere(query, here.map_key, found->result.camera_from_map, here.keyframe);
  if (!elsewhere) return true;
  if (elsewhere->result.Quality() > found->result.Quality()) std::swap(*found, *elsewhere);
  return found->result.Quality() >= options_.min_quality_ratio * elsewhere->result.Quality();
}

std::optional<VerifiedPlace> PlaceVerification::BestElsewhere(const Query& query, std::uint64_t map_key,
                                                              const Rigid3& camera_from_map,
                                                              KeyFrameId excluded_keyframe) {
  const WordBag words = MakeWordBag(*query.image.features);
  const auto retrieved =
      query.finder.FindPlaces({query.image.features->small_blurry, words}, options_.max_retrieved,
                              options_.max_retrieved_per_map, map_key);
  std::optional<VerifiedPlace> best;
  std::size_t tried = 0;
  for (const PlaceCandidate& candidate : retrieved) {
    if (tried == options_.max_verified) break;
    if (candidate.keyframe == excluded_keyframe) continue;
    const auto place = AlignPlace(candidate, query.image);
    if (!place) continue;
    ++tried;
    const VerifiedPlace other = Try(query, *place);
    const RejectionReason rejection =
        criteria_.RejectionReasonOf(other.result, *candidate.map, query.comparison);
    query.rejection->Consider({.rejection = rejection, .map_key = map_key, .inliers = other.result.inliers});
    if (rejection != RejectionReason::kNone || (best && other.result.Quality() <= best->result.Quality()))
      continue;
    const double depth = candidate.map->FindKeyFrame(candidate.keyframe)->mean_depth;
    if (!AreOfOnePlace(other.result.camera_from_map, camera_from_map, depth)) best = other;
  }
  return best;
}

std::optional<VerifiedPlace> PlaceVerification::BestCompetingMap(const Query& query,
                                                                 const std::vector<AlignedPlace>& places,
                                                                 std::set<std::uint64_t> excluded_maps) {
  std::optional<VerifiedPlace> best;
  std::size_t competing_maps = 0;
  for (const AlignedPlace& place : places) {
    if (competing_maps == options_.max_competing_maps) break;
    if (!excluded_maps.insert(place.candidate.map_key).second) continue;
    ++competing_maps;
    const VerifiedPlace verified = Try(query, place);
    const MapTrackResult& result = verified.result;
    const RejectionReason rejection =
        criteria_.RejectionReasonOf(result, *place.candidate.map, query.comparison);
    query.rejection->Consider(
        {.rejection = rejection, .map_key = place.candidate.map_key, .inliers = result.inliers});
    if (rejection == RejectionReason::kNone && (!best || result.Quality() > best->result.Quality()))
      best = verified;
  }
  return best;
}

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
// How a tracker comes back after a loss, and from one map to another (ptamm §3.2, §5.3, §6.3).
#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/tracking/tracker.h"

namespace docent::engine {

bool Tracker::RecoverNearby(const Frame& frame, TrackedFrame* out) {
  if (frame.time - lost_since_ > FromSeconds(options_.short_loss_s)) return false;
  const auto rotation = RotationFromPrevious();
  const Rigid3 guess = rotation ? motion_.PredictWithRotation(*rotation) : motion_.Predict(frame.time);
  map_tracker_.EnablePanorama(PanoramaFor(guess));
  const MapTrackResult result =
      map_tracker_.Track(*map_, *features_, guess, MapTracker::Effort::kRecovery, &random_);
  if (Recovered(result)) {
    out->state = TrackingState::kRelocalized;
    Accept(frame, result, out);
    return true;
  }
  map_tracker_.Forget();
  motion_.Reset(frame.time, guess);
  return false;
}

std::vector<Tracker::TurnedPlace> Tracker::BestPlaces(const PlaceFinder& places,
                                                      std::uint64_t but_map) const {
  std::vector<TurnedPlace> turned;
  const auto found = places.FindPlaces(features_->small_blurry, options_.candidates_looked_at,
                                       options_.candidates_of_a_map, 0);
  if (but_map != 0 && (found.empty() || found.front().map_key == but_map)) return turned;
  for (const PlaceCandidate& candidate : found) {
    if (candidate.map_key == but_map) continue;
    const KeyFrame* keyframe = candidate.map ? candidate.map->FindKeyFrame(candidate.keyframe) : nullptr;
    if (!keyframe) continue;
    const auto rotation =
        AlignRotation(keyframe->features->small_blurry, *keyframe->camera, features_->small_blurry, *camera_);
    if (!rotation) continue;
    // What overlaps little agrees easily.
    turned.push_back({candidate,
                      Rigid3(rotation->b_from_a, Eigen::Vector3d::Zero()) * keyframe->camera_from_map,
                      rotation->rms / std::sqrt(rotation->overlap)});
  }
  std::stable_sort(turned.begin(), turned.end(),
                   [](const TurnedPlace& a, const TurnedPlace& b) { return a.misfit < b.misfit; });
  if (turned.size() > options_.candidates) turned.resize(options_.candidates);
  return turned;
}

MapTrackResult Tracker::TryPlace(const TurnedPlace& place, MapTracker* tracker) {
  const PlaceCandidate& candidate = place.candidate;
  const KeyFrame* keyframe = candidate.map->FindKeyFrame(candidate.keyframe);
  tracker->Clear();
  tracker->EnablePanorama(keyframe ? keyframe->panorama : kNoId);
  return tracker->Track(*candidate.map, *features_, place.camera_from_map, MapTracker::Effort::kRecovery,
                        &random_);
}

void Tracker::BeginEntering(const TurnedPlace& place, const MapTracker& tracker,
                            const MapTrackResult& result) {
  entering_key_ = place.candidate.map_key;
  entering_panorama_ = tracker.panorama();
  entering_pose_ = result.camera_from_map;
  entering_frames_ = 1;
}

std::shared_ptr<const MapSnapshot> Tracker::FollowEntering(const PlaceFinder& places, MapTracker* tracker,
                                                           MapTrackResult* result) {
  const auto found = places.FindPlaces(features_->small_blurry, 1, 1, entering_key_);
  if (found.empty()) return nullptr;
  const auto rotation = RotationFromPrevious();
  const Rigid3 turn(rotation ? *rotation : Rotation3(), Eigen::Vector3d::Zero());
  tracker->Clear();
  tracker->EnablePanorama(entering_panorama_);
  *result = tracker->Track(*found.front().map, *features_, turn * entering_pose_, MapTracker::Effort::kWide,
                           &random_);
  return found.front().map;
}

void Tracker::Enter(const Frame& frame, std::shared_ptr<const MapSnapshot> map, const MapTrackResult& result,
                    TrackedFrame* out) {
  map_ = std::move(map);
  map_key_ = entering_key_;
  entering_frames_ = 0;
  reports_.clear();
  out->state = TrackingState::kRelocalized;
  out->hint.clear();
  Accept(frame, result, out);
}

// Where maps overlap the camera is carried from one into another by what both show; what was left in the
// other is only seen once it is entered. It is, when it explains the picture clearly better (ptamm §5.3).
void Tracker::LookForBetterMap(const Frame& frame, const PlaceFinder& places, TrackedFrame* out) {
  if (explained_ >= options_.poor_quality) {
    entering_frames_ = 0;
    return;
  }
  const auto better = [&](const MapTrackResult& result) {
    return Recovered(result) && result.Explained() > options_.better_quality * explained_;
  };
  MapTrackResult result;
  if (entering_frames_ > 0) {
    const auto map = FollowEntering(places, &rival_tracker_, &result);
    if (!map || !better(result)) {
      entering_frames_ = 0;
    } else if (entering_pose_ = result.camera_from_map; ++entering_frames_ >= options_.agreeing_frames) {
      // Once more as its own, so that all that a frame tells is of the new map.
      map_tracker_.Clear();
      map_tracker_.EnablePanorama(entering_panorama_);
      result = map_tracker_.Track(*map, *features_, entering_pose_, MapTracker::Effort::kUsual, &random_);
      Enter(frame, map, result, out);
    }
    return;
  }
  if (++frames_since_look_ < options_.frames_between_looks) return;
  frames_since_look_ = 0;
  for (const TurnedPlace& place : BestPlaces(places, map_key_)) {
    result = TryPlace(place, &rival_tracker_);
    if (!better(result)) continue;
    BeginEntering(place, rival_tracker_, result);
    return;
  }
}

void Tracker::Recover(const Frame& frame, const PlaceFinder* places, TrackedFrame* out) {
  out->state = map_ || !options_.build_maps ? TrackingState::kLost : TrackingState::kInitializing;
  out->hint = "look back at what was mapped";
  if (map_ && RecoverNearby(frame, out)) return;
  if (!places) return;
  MapTrackResult result;
  // A map that is about to be entered is followed, not searched anew.
  if (entering_frames_ > 0) {
    if (const auto map = FollowEntering(*places, &map_tracker_, &result); map && Recovered(result)) {
      entering_pose_ = result.camera_from_map;
      if (++entering_frames_ < options_.agreeing_frames) return;
      Enter(frame, map, result, out);
      return;
    }
    entering_frames_ = 0;
  }
  for (const TurnedPlace& place : BestPlaces(*places)) {
    const PlaceCandidate& candidate = place.candidate;
    result = TryPlace(place, &map_tracker_);
    if (!Recovered(result)) continue;
    if (candidate.map_key == map_key_) {
      out->state = TrackingState::kRelocalized;
      out->hint.clear();
      Accept(frame, result, out);
    } else {
      BeginEntering(place, map_tracker_, result);
    }
    return;
  }
  map_tracker_.Clear();
}

}  // namespace docent::engine

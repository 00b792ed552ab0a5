// SPDX-License-Identifier: Apache-2.0
// Relocalization after a loss, and changes from one map to another (ptamm §3.2, §5.3, §6.3).
#include <algorithm>
#include <bit>
#include <utility>

#include "engine/tracking/tracker.h"

namespace docent::engine {

RejectionReason Tracker::RejectionReasonOf(const MapTrackResult& result, const MapSnapshot& map) const {
  // Images that differ photometrically from the map's show fewer of its points, but still many, with small
  // residuals.
  const bool fits = comparison_ == PatchComparison::kTolerant &&
                    result.inliers >= options_.min_tolerant_inliers &&
                    result.sigma <= options_.max_tolerant_sigma;
  const double min_quality = fits ? options_.lost_quality : options_.min_recovery_quality;
  if (result.inliers < options_.min_recovery_inliers || result.Quality() < min_quality)
    return RejectionReason::kFewPoints;
  if (!result.converged || result.sigma > options_.max_sigma || !FitsRotation(result, map))
    return RejectionReason::kPoorFit;
  if (result.occupied_cells < options_.min_recovery_cells) return RejectionReason::kClustered;
  return RejectionReason::kNone;
}

// The visible inlier ratio that a frame needs after a relocalization to count towards extending the map. A
// camera that is found shortly after the loss near the lost pose has hardly reached another place of similar
// appearance. With many occlusions the ratio was never high; then about the ratio from before the loss
// suffices.
double Tracker::RequiredInlierRatio(const Frame& frame, const Rigid3& found_camera_from_map) const {
  // Ratio of the median depth, and radians: half the field of view of a 60 degree lens.
  constexpr double kNear = 0.5;
  const Rigid3& lost = motion_.last();
  const double shift = (lost.OriginInSource() - found_camera_from_map.OriginInSource()).norm();
  const double angle = (lost.rotation * found_camera_from_map.rotation.inverse()).Angle();
  if (frame.time - lost_since_ > FromSeconds(options_.short_loss_s) || shift > kNear * median_depth_ ||
      angle > kNear)
    return options_.poor_visible_ratio;
  return std::min(options_.poor_visible_ratio, mean_visible_inlier_ratio_ / options_.better_ratio);
}

bool Tracker::RecoverNearby(const Frame& frame, const PlaceFinder* places, TrackedFrame* out) {
  if (frame.time - lost_since_ > FromSeconds(options_.short_loss_s)) return false;
  const auto rotation = RotationFromPrevious();
  const Rigid3 guess = rotation ? motion_.PredictWithRotation(*rotation) : motion_.Predict(frame.time);
  map_tracker_.EnablePanorama(PanoramaFor(guess));
  MapTrackResult result =
      map_tracker_.Track(*map_, *features_, guess, MapTracker::Effort::kRecovery, &random_);
  const RejectionReason rejection = RejectionReasonOf(result, *map_);
  if (rejection != RejectionReason::kNone && !options_.build_maps) {
    // With too few patches on the upper levels for a pose, the predicted pose may still be good.
    for (const auto effort : {MapTracker::Effort::kStandard, MapTracker::Effort::kWide}) {
      if (HoldsTrack(result)) break;
      result = map_tracker_.Track(*map_, *features_, guess, effort, &random_);
    }
    if (HoldsTrack(result)) {
      out->state = TrackingState::kRelocalized;
      Accept(frame, result, out);
      return true;
    }
  }
  if (rejection == RejectionReason::kNone) {
    // A place with a low visible inlier ratio may be another one of similar appearance.
    const auto is_better = [&](const std::optional<VerifiedPlace>& competitor) {
      return competitor &&
             competitor->result.VisibleInlierRatio() >= options_.better_ratio * result.VisibleInlierRatio();
    };
    const bool poor = places && result.VisibleInlierRatio() < options_.poor_visible_ratio;
    if (!poor || !(is_better(BestElsewhere(*places, map_key_, result.camera_from_map, kNoId, out)) ||
                   is_better(BestCompetingMap(BestPlaces(*places), {map_key_}, out)))) {
      if (poor) {
        if (hypothesis_frames_ > 0) return false;
        BeginRelocalization({{{map_key_, map_}, guess}, result, map_tracker_.panorama()});
        SetUnconfirmed(result, out);
        return true;
      }
      out->state = TrackingState::kRelocalized;
      Accept(frame, result, out);
      return true;
    }
  }
  out->relocalization.Consider({.rejection = rejection, .map_key = map_key_, .inliers = result.inliers});
  map_tracker_.ForgetLastFrame();
  motion_.Reset(frame.time, guess);
  return false;
}

bool Tracker::IsUnambiguous(std::uint64_t best_key, double best_quality, std::uint64_t second_key,
                            double second_quality) {
  const bool ahead = best_quality > second_quality;
  if (best_key != leader_key_ || !ahead) leader_frames_ = 0;
  if (ahead) ++leader_frames_;
  leader_key_ = best_key;
  // The map that the camera was in is preferred.
  const double lead = second_key == map_key_ ? options_.better_ratio : options_.min_quality_ratio;
  return ahead && (best_quality >= lead * second_quality || leader_frames_ >= options_.min_leading_frames);
}

void Tracker::BeginRelocalization(const VerifiedPlace& found) {
  hypothesis_key_ = found.place.candidate.map_key;
  hypothesis_panorama_ = found.panorama;
  hypothesis_pose_ = found.result.camera_from_map;
  hypothesis_frames_ = 1;
}

std::shared_ptr<const MapSnapshot> Tracker::TrackHypothesis(const PlaceFinder& places, MapTracker* tracker,
                                                            MapTrackResult* result) {
  std::shared_ptr<const MapSnapshot> map = map_;
  if (hypothesis_key_ != map_key_) {
    const auto found = places.FindPlaces(features_->small_blurry, 1, 1, hypothesis_key_);
    if (found.empty()) return nullptr;
    map = found.front().map;
  }
  const auto rotation = RotationFromPrevious();
  const Rigid3 rotated(rotation ? *rotation : Rotation3(), Eigen::Vector3d::Zero());
  tracker->Clear();
  tracker->EnablePanorama(hypothesis_panorama_);
  *result = tracker->Track(*map, *features_, rotated * hypothesis_pose_, MapTracker::Effort::kWide, &random_);
  return map;
}

void Tracker::EnterMap(const Frame& frame, std::shared_ptr<const MapSnapshot> map,
                       const MapTrackResult& result, TrackedFrame* out) {
  if (hypothesis_key_ != map_key_) mean_visible_inlier_ratio_ = 1;  // unknown in another map
  map_ = std::move(map);
  map_key_ = hypothesis_key_;
  hypothesis_frames_ = 0;
  reports_.clear();
  out->state = TrackingState::kRelocalized;
  out->hint.clear();
  Accept(frame, result, out);
  // Near the lost pose the confirming frames count already.
  if (required_inlier_ratio_ < options_.poor_visible_ratio) unconfirmed_frames_ = 1;
}

// Where maps overlap, the points that both contain keep the camera in its present map although the other one
// may show more from here. The other map is entered when its visible inlier ratio is clearly higher (ptamm
// §5.3).
void Tracker::SearchBetterMap(const Frame& frame, const PlaceFinder& places, TrackedFrame* out) {
  if (visible_inlier_ratio_ >= options_.poor_visible_ratio) {
    hypothesis_frames_ = 0;
    return;
  }
  const auto better = [&](const MapTrackResult& result) {
    return result.VisibleInlierRatio() > options_.better_ratio * visible_inlier_ratio_;
  };
  MapTrackResult result;
  if (hypothesis_frames_ > 0) {
    const auto map = TrackHypothesis(places, &competing_tracker_, &result);
    if (!map || RejectionReasonOf(result, *map) != RejectionReason::kNone || !better(result)) {
      hypothesis_frames_ = 0;
    } else if (hypothesis_pose_ = result.camera_from_map;
               ++hypothesis_frames_ >= options_.confirming_frames) {
      // Tracks once more with the main tracker, so that all results of the frame refer to the new map.
      map_tracker_.Clear();
      map_tracker_.EnablePanorama(hypothesis_panorama_);
      result =
          map_tracker_.Track(*map, *features_, hypothesis_pose_, MapTracker::Effort::kStandard, &random_);
      EnterMap(frame, map, result, out);
    }
    return;
  }
  const bool good = out->quality >= options_.good_quality;
  if (++frames_since_better_map_search_ < options_.frames_between_better_map_searches && good) return;
  frames_since_better_map_search_ = 0;
  std::vector<AlignedPlace> others = BestPlaces(places, map_key_);
  if (others.size() > options_.max_verified) others.resize(options_.max_verified);
  for (const AlignedPlace& place : others) {
    result = VerifyPlace(place, &competing_tracker_);
    if (RejectionReasonOf(result, *place.candidate.map) != RejectionReason::kNone || !better(result))
      continue;
    BeginRelocalization({place, result, competing_tracker_.panorama()});
    return;
  }
}

// Used in a map that was started because the camera was lost: if a known map explains the image, the camera
// returns to it as if it were still lost, so that no place is mapped twice.
void Tracker::SearchKnownMaps(const Frame& frame, const PlaceFinder& places, TrackedFrame* out) {
  // A search costs as much as ten frames: about four per second, and more often while little would be lost by
  // returning.
  const int frames_between = map_->HasFinitePoints() ? 8 : 2;
  if (hypothesis_frames_ > 0 && hypothesis_key_ != map_key_) {
    MapTrackResult result;
    const auto map = TrackHypothesis(places, &competing_tracker_, &result);
    if (!map || RejectionReasonOf(result, *map) != RejectionReason::kNone ||
        result.VisibleInlierRatio() < options_.poor_visible_ratio) {
      hypothesis_frames_ = 0;
      return;
    }
    hypothesis_pose_ = result.camera_from_map;
    if (++hypothesis_frames_ < options_.confirming_frames) return;
    map_tracker_.Clear();
    map_tracker_.EnablePanorama(hypothesis_panorama_);
    result = map_tracker_.Track(*map, *features_, hypothesis_pose_, MapTracker::Effort::kStandard, &random_);
    starting_ = pair_given_ = search_known_maps_ = false;
    candidate_.reset();
    ResetStart();
    EnterMap(frame, map, result, out);
    return;
  }
  if (++frames_since_better_map_search_ < frames_between) return;
  frames_since_better_map_search_ = 0;
  const RelocalizationResult before = out->relocalization;
  const std::vector<VerifiedPlace> found = VerifyPlaces(places, BestPlaces(places, map_key_), out);
  out->relocalization = before;
  if (found.empty() || found.front().result.VisibleInlierRatio() < options_.poor_visible_ratio) return;
  const bool competitor = found.size() > 1 && found.front().result.Quality() <
                                                  options_.min_quality_ratio * found[1].result.Quality();
  if (!competitor) BeginRelocalization(found.front());
}

// A relocalization with a low visible inlier ratio may be at another place of similar appearance: until the
// ratio is high enough, other places of the map are tried.
void Tracker::SearchBetterPlace(const Frame& frame, const PlaceFinder& places, TrackedFrame* out) {
  if (unconfirmed_frames_ == 0) return;
  ++frames_since_recovery_;
  if (visible_inlier_ratio_ >= options_.poor_visible_ratio) return;
  // A search costs as much as ten frames, so it runs less and less often: the place may have changed
  // permanently.
  constexpr unsigned kMaxInterval = 32;
  const unsigned frames = frames_since_recovery_;
  if (frames < 2 || !(std::has_single_bit(frames) || frames % kMaxInterval == 0)) return;
  const auto other = BestElsewhere(places, map_key_, out->camera_from_map, kNoId, out);
  const double needed = std::max(options_.poor_visible_ratio, options_.better_ratio * visible_inlier_ratio_);
  if (other && other->result.VisibleInlierRatio() >= needed) ReturnToMap(frame, *other, out);
  out->relocalization = {};
}

void Tracker::SetUnconfirmed(const MapTrackResult& result, TrackedFrame* out) const {
  out->relocalization = {.rejection = RejectionReason::kUnconfirmed,
                         .map_key = hypothesis_key_,
                         .inliers = result.inliers,
                         .frames = hypothesis_frames_};
}

// Continues a hypothesis by tracking it from its previous pose, which makes consecutive poses agree; false if
// it fails.
bool Tracker::ContinueRelocalization(const Frame& frame, const PlaceFinder& places, TrackedFrame* out) {
  if (hypothesis_frames_ == 0) return false;
  MapTrackResult result;
  const auto map = TrackHypothesis(places, &map_tracker_, &result);
  const RejectionReason rejection = map ? RejectionReasonOf(result, *map) : RejectionReason::kFewPoints;
  if (rejection != RejectionReason::kNone) {
    out->relocalization.Consider(
        {.rejection = rejection, .map_key = hypothesis_key_, .inliers = result.inliers});
    hypothesis_frames_ = 0;
    return false;
  }
  if (const auto competitor = BestCompetingMap(BestPlaces(places), {hypothesis_key_}, out)) {
    const std::uint64_t competitor_key = competitor->place.candidate.map_key;
    if (!IsUnambiguous(hypothesis_key_, result.Quality(), competitor_key, competitor->result.Quality())) {
      hypothesis_frames_ = 0;
      out->relocalization = {.rejection = RejectionReason::kAmbiguous,
                             .map_key = hypothesis_key_,
                             .competitor_key = competitor_key,
                             .inliers = result.inliers};
      return true;
    }
  }
  hypothesis_pose_ = result.camera_from_map;
  if (++hypothesis_frames_ >= options_.confirming_frames) {
    EnterMap(frame, map, result, out);
  } else {
    SetUnconfirmed(result, out);
  }
  return true;
}

// Returns to the map that the camera was in: tracks once more with the main tracker, so that all results of
// the frame refer to this place.
void Tracker::ReturnToMap(const Frame& frame, const VerifiedPlace& found, TrackedFrame* out) {
  if (found.result.VisibleInlierRatio() < options_.poor_visible_ratio) {
    // Too little of what is in view fits; it may be a place of similar appearance.
    BeginRelocalization(found);
    SetUnconfirmed(found.result, out);
    return;
  }
  hypothesis_frames_ = 0;
  map_tracker_.Clear();
  map_tracker_.EnablePanorama(found.panorama);
  const MapTrackResult result = map_tracker_.Track(*map_, *features_, found.result.camera_from_map,
                                                   MapTracker::Effort::kStandard, &random_);
  if (const RejectionReason rejection = RejectionReasonOf(result, *map_);
      rejection != RejectionReason::kNone) {
    out->relocalization.Consider({.rejection = rejection, .map_key = map_key_, .inliers = result.inliers});
    return;
  }
  out->state = TrackingState::kRelocalized;
  out->hint.clear();
  Accept(frame, result, out);
}

void Tracker::Recover(const Frame& frame, const PlaceFinder* places, TrackedFrame* out) {
  out->state = map_ || !options_.build_maps ? TrackingState::kLost : TrackingState::kInitializing;
  out->hint = map_ || !options_.build_maps ? "Look back at a place you have seen before."
                                           : "Press New map to begin, or look at a mapped place.";
  // The exposure or sharpness may have changed, so every other frame uses photometric tolerance. A hypothesis
  // is continued with the comparison that found it.
  if (hypothesis_frames_ == 0 && frames_lost_++ > 0) {
    SetComparison(comparison_ == PatchComparison::kStandard ? PatchComparison::kTolerant
                                                            : PatchComparison::kStandard);
  }
  if (map_ && RecoverNearby(frame, places, out)) return;
  if (!places || ContinueRelocalization(frame, *places, out)) return;
  // For a short time after the loss the same points are still occluded.
  if (options_.build_maps || !map_ || frame.time - lost_since_ > FromSeconds(options_.short_loss_s))
    map_tracker_.Clear();
  const std::vector<AlignedPlace> by_thumbnail = BestPlaces(*places);
  std::vector<VerifiedPlace> found = VerifyPlaces(*places, by_thumbnail, out);
  if (found.empty() && out->relocalization.rejection != RejectionReason::kAmbiguous) {
    // Visual words retrieve places whose thumbnails differ; the places found by thumbnail remain as
    // competitors.
    std::vector<AlignedPlace> others = PlacesByWords(*places, by_thumbnail);
    if (!others.empty()) {
      others.insert(others.end(), by_thumbnail.begin(), by_thumbnail.end());
      found = VerifyPlaces(*places, others, out);
    }
  }
  if (found.empty() && out->relocalization.rejection != RejectionReason::kAmbiguous) {
    // No keyframe is close enough for an alignment by rotation; descriptor matching works from further away.
    std::vector<AlignedPlace> others = PlacesByDescriptors(*places);
    if (!others.empty()) {
      others.insert(others.end(), by_thumbnail.begin(), by_thumbnail.end());
      found = VerifyPlaces(*places, others, out);
    }
  }
  if (found.empty()) return;
  const auto key = [&](std::size_t i) { return found[i].place.candidate.map_key; };
  if (found.size() > 1 &&
      !IsUnambiguous(key(0), found[0].result.Quality(), key(1), found[1].result.Quality())) {
    // With an ambiguity the camera is assumed to be still in its map.
    const auto own = std::find_if(found.begin(), found.end(), [&](const VerifiedPlace& place) {
      return place.place.candidate.map_key == map_key_;
    });
    if (own != found.end()) return ReturnToMap(frame, *own, out);
    out->relocalization = {.rejection = RejectionReason::kAmbiguous,
                           .map_key = key(0),
                           .competitor_key = key(1),
                           .inliers = found[0].result.inliers};
    return;
  }
  if (key(0) == map_key_) return ReturnToMap(frame, found[0], out);
  BeginRelocalization(found[0]);
  SetUnconfirmed(found[0].result, out);
}

}  // namespace docent::engine

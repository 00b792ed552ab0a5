// SPDX-License-Identifier: Apache-2.0
// How a tracker comes back after a loss, and from one map to another (ptamm §3.2, §5.3, §6.3).
#include <algorithm>
#include <bit>
#include <utility>

#include "engine/tracking/tracker.h"

namespace docent::engine {

// Whether a pose that was found after a loss counts: kNone, or what speaks against it.
RejectionReason Tracker::RejectionReasonOf(const MapTrackResult& result, const MapSnapshot& map) const {
  // Images that differ from the map's show fewer of its points, but still many of them, which fit well.
  const bool fits = comparison_ == PatchComparison::kTolerant &&
                    result.inliers >= options_.min_fitting_inliers &&
                    result.sigma <= options_.max_fitting_sigma;
  const double min_quality = fits ? options_.lost_quality : options_.min_recovery_quality;
  if (result.inliers < options_.min_recovery_inliers || result.Quality() < min_quality)
    return RejectionReason::kFewPoints;
  if (!result.converged || result.sigma > options_.max_sigma || !IsTurn(result, map))
    return RejectionReason::kPoorFit;
  if (result.occupied_cells < options_.min_recovery_cells) return RejectionReason::kOneCorner;
  return RejectionReason::kNone;
}

// What a frame must explain after a recovery to count for the map's extension. A camera that was lost a
// moment ago and is found about where it was lost has hardly come to a place that looks alike. Where things
// hide each other a map never explained much of what is in view; it explains enough when it explains about as
// much as before.
double Tracker::RequiredInlierRatio(const Frame& frame, const Rigid3& found_camera_from_map) const {
  constexpr double kNear = 0.5;  // of the depth, and radians: half the field of view of a 60 degree lens
  const Rigid3& lost = motion_.last();
  const double shift = (lost.OriginInSource() - found_camera_from_map.OriginInSource()).norm();
  const double turn = (lost.rotation * found_camera_from_map.rotation.inverse()).Angle();
  if (frame.time - lost_since_ > FromSeconds(options_.short_loss_s) || shift > kNear * median_depth_ ||
      turn > kNear)
    return options_.poor_quality;
  return std::min(options_.poor_quality, mean_visible_inlier_ratio_ / options_.better_quality);
}

bool Tracker::RecoverNearby(const Frame& frame, const PlaceFinder* places, TrackedFrame* out) {
  if (frame.time - lost_since_ > FromSeconds(options_.short_loss_s)) return false;
  const auto rotation = RotationFromPrevious();
  const Rigid3 guess = rotation ? motion_.PredictWithRotation(*rotation) : motion_.Predict(frame.time);
  map_tracker_.EnablePanorama(PanoramaFor(guess));
  MapTrackResult result =
      map_tracker_.Track(*map_, *features_, guess, MapTracker::Effort::kRecovery, &random_);
  const RejectionReason doubt = RejectionReasonOf(result, *map_);
  if (doubt != RejectionReason::kNone && !options_.build_maps) {
    // Where the patches of the upper levels are too few to tell a pose, the guess may still be good.
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
  if (doubt == RejectionReason::kNone) {
    // What is poorly seen may be something else that is only alike.
    const auto is_better = [&](const std::optional<FoundPlace>& competitor) {
      return competitor &&
             competitor->result.VisibleInlierRatio() >= options_.better_quality * result.VisibleInlierRatio();
    };
    const bool poor = places && result.VisibleInlierRatio() < options_.poor_quality;
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
  out->verdict.Consider({.doubt = doubt, .map_key = map_key_, .inliers = result.inliers});
  map_tracker_.Forget();
  motion_.Reset(frame.time, guess);
  return false;
}

bool Tracker::IsUnambiguous(std::uint64_t best_key, double best_quality, std::uint64_t second_key,
                            double second_quality) {
  const bool ahead = best_quality > second_quality;
  if (best_key != leader_key_ || !ahead) leader_frames_ = 0;
  if (ahead) ++leader_frames_;
  leader_key_ = best_key;
  // Whoever was in one of them stays there in case of doubt.
  const double lead = second_key == map_key_ ? options_.better_quality : options_.min_quality_ratio;
  return ahead && (best_quality >= lead * second_quality || leader_frames_ >= options_.min_leading_frames);
}

void Tracker::BeginRelocalization(const FoundPlace& found) {
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
  const Rigid3 turn(rotation ? *rotation : Rotation3(), Eigen::Vector3d::Zero());
  tracker->Clear();
  tracker->EnablePanorama(hypothesis_panorama_);
  *result = tracker->Track(*map, *features_, turn * hypothesis_pose_, MapTracker::Effort::kWide, &random_);
  return map;
}

void Tracker::Enter(const Frame& frame, std::shared_ptr<const MapSnapshot> map, const MapTrackResult& result,
                    TrackedFrame* out) {
  if (hypothesis_key_ != map_key_) mean_visible_inlier_ratio_ = 1;  // unknown, in another map
  map_ = std::move(map);
  map_key_ = hypothesis_key_;
  hypothesis_frames_ = 0;
  reports_.clear();
  out->state = TrackingState::kRelocalized;
  out->hint.clear();
  Accept(frame, result, out);
  // The frames that agreed have counted already where the camera is about where it was lost.
  if (required_inlier_ratio_ < options_.poor_quality) doubtful_frames_ = 1;
}

// Where maps overlap the camera is carried from one into another by what both show; what was left in the
// other is only seen once it is entered. It is, when it explains the image clearly better (ptamm §5.3).
void Tracker::SearchBetterMap(const Frame& frame, const PlaceFinder& places, TrackedFrame* out) {
  if (visible_inlier_ratio_ >= options_.poor_quality) {
    hypothesis_frames_ = 0;
    return;
  }
  const auto better = [&](const MapTrackResult& result) {
    return result.VisibleInlierRatio() > options_.better_quality * visible_inlier_ratio_;
  };
  MapTrackResult result;
  if (hypothesis_frames_ > 0) {
    const auto map = TrackHypothesis(places, &competing_tracker_, &result);
    if (!map || RejectionReasonOf(result, *map) != RejectionReason::kNone || !better(result)) {
      hypothesis_frames_ = 0;
    } else if (hypothesis_pose_ = result.camera_from_map; ++hypothesis_frames_ >= options_.agreeing_frames) {
      // Once more as its own, so that all that a frame tells is of the new map.
      map_tracker_.Clear();
      map_tracker_.EnablePanorama(hypothesis_panorama_);
      result =
          map_tracker_.Track(*map, *features_, hypothesis_pose_, MapTracker::Effort::kStandard, &random_);
      Enter(frame, map, result, out);
    }
    return;
  }
  const bool well_enough = out->quality >= options_.good_quality;
  if (++frames_since_better_map_search_ < options_.frames_between_better_map_searches && well_enough) return;
  frames_since_better_map_search_ = 0;
  std::vector<AlignedPlace> others = BestPlaces(places, map_key_);
  if (others.size() > options_.candidates) others.resize(options_.candidates);
  for (const AlignedPlace& place : others) {
    result = TryPlace(place, &competing_tracker_);
    if (RejectionReasonOf(result, *place.candidate.map) != RejectionReason::kNone || !better(result))
      continue;
    BeginRelocalization({place, result, competing_tracker_.panorama()});
    return;
  }
}

// A map that was begun because the camera was lost: where another map explains the image, the camera goes
// back there, as if it were still lost, so that the same place is not mapped twice.
void Tracker::SearchKnownMaps(const Frame& frame, const PlaceFinder& places, TrackedFrame* out) {
  // A search costs as much as ten frames: about four a second, and more as long as hardly anything would be
  // lost by going back.
  const int frames_between = map_->HasFinitePoints() ? 8 : 2;
  if (hypothesis_frames_ > 0 && hypothesis_key_ != map_key_) {
    MapTrackResult result;
    const auto map = TrackHypothesis(places, &competing_tracker_, &result);
    if (!map || RejectionReasonOf(result, *map) != RejectionReason::kNone ||
        result.VisibleInlierRatio() < options_.poor_quality) {
      hypothesis_frames_ = 0;
      return;
    }
    hypothesis_pose_ = result.camera_from_map;
    if (++hypothesis_frames_ < options_.agreeing_frames) return;
    map_tracker_.Clear();
    map_tracker_.EnablePanorama(hypothesis_panorama_);
    result = map_tracker_.Track(*map, *features_, hypothesis_pose_, MapTracker::Effort::kStandard, &random_);
    starting_ = pair_given_ = search_known_maps_ = false;
    candidate_.reset();
    ResetStart();
    Enter(frame, map, result, out);
    return;
  }
  if (++frames_since_better_map_search_ < frames_between) return;
  frames_since_better_map_search_ = 0;
  const RelocalizationResult before = out->verdict;
  const std::vector<FoundPlace> found = FindMaps(places, BestPlaces(places, map_key_), out);
  out->verdict = before;
  if (found.empty() || found.front().result.VisibleInlierRatio() < options_.poor_quality) return;
  const bool competitor = found.size() > 1 && found.front().result.Quality() <
                                                  options_.min_quality_ratio * found[1].result.Quality();
  if (!competitor) BeginRelocalization(found.front());
}

// What was found again by a part of what is in view may be another place that looks alike: as long as it is
// seen no better, the others are asked.
void Tracker::SearchBetterPlace(const Frame& frame, const PlaceFinder& places, TrackedFrame* out) {
  if (doubtful_frames_ == 0) return;
  ++frames_since_recovery_;
  if (visible_inlier_ratio_ >= options_.poor_quality) return;
  // A look costs as much as ten frames: ever more seldom, for a place may have changed for good.
  constexpr unsigned kSeldom = 32;
  const unsigned frames = frames_since_recovery_;
  if (frames < 2 || !(std::has_single_bit(frames) || frames % kSeldom == 0)) return;
  const auto other = BestElsewhere(places, map_key_, out->camera_from_map, kNoId, out);
  const double needed = std::max(options_.poor_quality, options_.better_quality * visible_inlier_ratio_);
  if (other && other->result.VisibleInlierRatio() >= needed) Return(frame, *other, out);
  out->verdict = {};
}

void Tracker::SetUnconfirmed(const MapTrackResult& result, TrackedFrame* out) const {
  out->verdict = {.doubt = RejectionReason::kUnconfirmed,
                  .map_key = hypothesis_key_,
                  .inliers = result.inliers,
                  .frames = hypothesis_frames_};
}

// A map that is about to be entered is followed, not searched anew; false when it does not hold. Its poses
// agree: each is looked for close about the one before.
bool Tracker::ContinueRelocalization(const Frame& frame, const PlaceFinder& places, TrackedFrame* out) {
  if (hypothesis_frames_ == 0) return false;
  MapTrackResult result;
  const auto map = TrackHypothesis(places, &map_tracker_, &result);
  const RejectionReason doubt = map ? RejectionReasonOf(result, *map) : RejectionReason::kFewPoints;
  if (doubt != RejectionReason::kNone) {
    out->verdict.Consider({.doubt = doubt, .map_key = hypothesis_key_, .inliers = result.inliers});
    hypothesis_frames_ = 0;
    return false;
  }
  if (const auto competitor = BestCompetingMap(BestPlaces(places), {hypothesis_key_}, out)) {
    const std::uint64_t competitor_key = competitor->place.candidate.map_key;
    if (!IsUnambiguous(hypothesis_key_, result.Quality(), competitor_key, competitor->result.Quality())) {
      hypothesis_frames_ = 0;
      out->verdict = {.doubt = RejectionReason::kLookAlikes,
                      .map_key = hypothesis_key_,
                      .competitor_key = competitor_key,
                      .inliers = result.inliers};
      return true;
    }
  }
  hypothesis_pose_ = result.camera_from_map;
  if (++hypothesis_frames_ >= options_.agreeing_frames) {
    Enter(frame, map, result, out);
  } else {
    SetUnconfirmed(result, out);
  }
  return true;
}

// Into the map that the camera was in: once more as its own, so that all that the frame tells is of it.
void Tracker::Return(const Frame& frame, const FoundPlace& found, TrackedFrame* out) {
  if (found.result.VisibleInlierRatio() < options_.poor_quality) {
    // What fits a part of what is in view may be alike only.
    BeginRelocalization(found);
    SetUnconfirmed(found.result, out);
    return;
  }
  hypothesis_frames_ = 0;
  map_tracker_.Clear();
  map_tracker_.EnablePanorama(found.panorama);
  const MapTrackResult result = map_tracker_.Track(*map_, *features_, found.result.camera_from_map,
                                                   MapTracker::Effort::kStandard, &random_);
  if (const RejectionReason doubt = RejectionReasonOf(result, *map_); doubt != RejectionReason::kNone) {
    out->verdict.Consider({.doubt = doubt, .map_key = map_key_, .inliers = result.inliers});
    return;
  }
  out->state = TrackingState::kRelocalized;
  out->hint.clear();
  Accept(frame, result, out);
}

void Tracker::Recover(const Frame& frame, const PlaceFinder* places, TrackedFrame* out) {
  out->state = map_ || !options_.build_maps ? TrackingState::kLost : TrackingState::kInitializing;
  out->hint = "look back at what was mapped";
  // Every other frame: the exposure or sharpness may have changed. A map that is about to be entered is
  // followed as it was found.
  if (hypothesis_frames_ == 0 && frames_lost_++ > 0) {
    Compare(comparison_ == PatchComparison::kStandard ? PatchComparison::kTolerant
                                                      : PatchComparison::kStandard);
  }
  if (map_ && RecoverNearby(frame, places, out)) return;
  if (!places || ContinueRelocalization(frame, *places, out)) return;
  // What was hidden from where a visitor was lost is so for a while.
  if (options_.build_maps || !map_ || frame.time - lost_since_ > FromSeconds(options_.short_loss_s))
    map_tracker_.Clear();
  const std::vector<AlignedPlace> alike = BestPlaces(*places);
  std::vector<FoundPlace> found = FindMaps(*places, alike, out);
  if (found.empty() && out->verdict.doubt != RejectionReason::kLookAlikes) {
    // What does not look alike at once may still show the same things; what does is a competitor at least.
    std::vector<AlignedPlace> others = PlacesByWords(*places, alike);
    if (!others.empty()) {
      others.insert(others.end(), alike.begin(), alike.end());
      found = FindMaps(*places, others, out);
    }
  }
  if (found.empty() && out->verdict.doubt != RejectionReason::kLookAlikes) {
    // No keyframe is near enough to be turned until it fits; descriptors tell the pose from further away.
    std::vector<AlignedPlace> others = PlacesByDescriptors(*places);
    if (!others.empty()) {
      others.insert(others.end(), alike.begin(), alike.end());
      found = FindMaps(*places, others, out);
    }
  }
  if (found.empty()) return;
  const auto key = [&](std::size_t i) { return found[i].place.candidate.map_key; };
  if (found.size() > 1 &&
      !IsUnambiguous(key(0), found[0].result.Quality(), key(1), found[1].result.Quality())) {
    // In case of doubt the camera is still where it was.
    const auto own = std::find_if(found.begin(), found.end(), [&](const FoundPlace& place) {
      return place.place.candidate.map_key == map_key_;
    });
    if (own != found.end()) return Return(frame, *own, out);
    out->verdict = {.doubt = RejectionReason::kLookAlikes,
                    .map_key = key(0),
                    .competitor_key = key(1),
                    .inliers = found[0].result.inliers};
    return;
  }
  if (key(0) == map_key_) return Return(frame, found[0], out);
  BeginRelocalization(found[0]);
  SetUnconfirmed(found[0].result, out);
}

}  // namespace docent::engine

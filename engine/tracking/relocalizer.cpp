// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/relocalizer.h"

#include <algorithm>
#include <utility>

namespace docent::engine {

namespace {

// Any frame time can be subtracted without overflow.
constexpr Timestamp kDistantPast = -std::chrono::hours(24 * 365 * 50);

}  // namespace

void Relocalizer::Lose(Timestamp time) {
  lost_since_ = time;
  frames_lost_ = 0;
}

void Relocalizer::LoseLongAgo() {
  lost_since_ = kDistantPast;
}

// A place with a low visible inlier ratio may be another one of similar appearance.
bool Relocalizer::HasBetterCompetitor(const PoseSearch& search, const MapTrackResult& result,
                                      TrackedFrame* out) const {
  const auto is_better = [&](const std::optional<VerifiedPlace>& competitor) {
    return competitor &&
           competitor->result.VisibleInlierRatio() >= options_.better_ratio * result.VisibleInlierRatio();
  };
  const auto query = search.Query(&out->relocalization);
  return is_better(
             search.verification->BestElsewhere(query, search.map_key, result.camera_from_map, kNoId)) ||
         is_better(search.verification->BestCompetingMap(
             query, search.retrieval->ByThumbnail(search.image, *search.finder), {search.map_key}));
}

Relocalizer::Attempt Relocalizer::SearchNearby(const PoseSearch& search, TrackedFrame* out,
                                               std::optional<FoundPose>* found) {
  if (search.image.time - lost_since_ > FromSeconds(options_.short_loss_s)) return Attempt::kGoOn;
  const Rigid3 guess = search.pose->PredictAfterLoss(search.image);
  search.pose->SearchPanoramaAt(guess, *search.map, search.policy);
  if (search.has_odometry) search.pose->ExpectPosition(search.image.time);
  const auto track = [&](MapTracker::Effort effort) {
    return search.pose->TryFrom(*search.map, search.image, guess, effort, search.random);
  };
  MapTrackResult result = track(MapTracker::Effort::kRelocalization);
  const RejectionReason rejection = search.RejectionReasonOf(result, *search.map);
  if (!options_.build_maps && !search.has_odometry) {
    // With too few patches on the upper levels for a pose, the predicted pose may still be good.
    for (const auto effort : {MapTracker::Effort::kStandard, MapTracker::Effort::kWide}) {
      if (rejection == RejectionReason::kNone || search.criteria.KeepsTrackWithFewPoints(result)) break;
      result = track(effort);
    }
    // So soon after the loss and so near, what suffices to hold the track needs no confirmation.
    if (search.criteria.KeepsTrackWithFewPoints(result)) {
      *found = FoundPose{FoundPose::How::kNearby, search.map, search.map_key, result};
      return Attempt::kFound;
    }
  }
  if (rejection == RejectionReason::kNone) {
    const bool poor = search.finder && result.VisibleInlierRatio() < options_.poor_visible_ratio;
    if (!poor || !HasBetterCompetitor(search, result, out)) {
      if (!poor) {
        *found = FoundPose{FoundPose::How::kNearby, search.map, search.map_key, result};
        return Attempt::kFound;
      }
      // A hypothesis elsewhere does not keep the author's camera from where it just was. A visitor's last
      // pose may come from visual odometry, which can follow people.
      MapHypothesis& hypothesis = *search.hypothesis;
      if (hypothesis.exists() &&
          (!options_.build_maps || hypothesis.IsOfPlace(search.image, search.map_key, result)))
        return Attempt::kGoOn;
      hypothesis.Begin(search.map_key, result.camera_from_map, search.pose->map_tracker().panorama());
      out->relocalization = hypothesis.Unconfirmed(result);
      return Attempt::kEnded;
    }
  }
  // Where the map is where visual odometry expects it, but only a part of the image shows it, odometry has
  // the better position. Place recognition had put a visitor 0.6 m away before a wall then, in 7 of 20 visits
  // to a rendered room.
  if (rejection == RejectionReason::kClustered && search.has_odometry &&
      AreOfOnePlace(guess, result.camera_from_map, result.median_depth) &&
      (!search.finder || !HasBetterCompetitor(search, result, out))) {
    if (search.hypothesis->map_key() == search.map_key) search.hypothesis->Clear();
    out->relocalization = {.rejection = rejection, .map_key = search.map_key, .inliers = result.inliers};
    return Attempt::kEnded;
  }
  out->relocalization.Consider(
      {.rejection = rejection, .map_key = search.map_key, .inliers = result.inliers});
  search.pose->ContinueFrom(search.image.time, guess);
  return Attempt::kGoOn;
}

bool Relocalizer::IsUnambiguous(std::uint64_t best_key, double best_quality, std::uint64_t second_key,
                                double second_quality, std::uint64_t own) {
  const bool ahead = best_quality > second_quality;
  if (best_key != leader_.key || !ahead) leader_.frames = 0;
  if (ahead) ++leader_.frames;
  leader_.key = best_key;
  // The map that the camera was in is preferred.
  const double lead = second_key == own ? options_.better_ratio : options_.min_quality_ratio;
  return ahead && (best_quality >= lead * second_quality || leader_.frames >= options_.min_leading_frames);
}

Relocalizer::Attempt Relocalizer::ContinueHypothesis(const PoseSearch& search, MapHypothesis* missed,
                                                     TrackedFrame* out, std::optional<FoundPose>* found) {
  MapHypothesis& hypothesis = *search.hypothesis;
  if (!hypothesis.exists()) return Attempt::kGoOn;
  MapTrackResult result;
  RejectionReason rejection = RejectionReason::kFewPoints;
  auto map = search.MapOfHypothesis();
  const auto track = [&](MapTracker::Effort effort) {
    result = search.pose->TryElsewhere(*map, search.image, hypothesis.Predict(search.image),
                                       hypothesis.panorama(), effort, search.random);
    rejection = search.RejectionReasonOf(result, *map);
  };
  if (map) track(MapTracker::Effort::kStandard);
  // A wide search finds the wrong ones of things that repeat, such as the squares of a board or windows.
  // Where that is likely, because few of the points in view are inliers, the pose has to withstand it.
  const bool poor = result.VisibleInlierRatio() < options_.poor_visible_ratio;
  if (map && (poor || rejection != RejectionReason::kNone)) track(MapTracker::Effort::kWide);
  if (rejection != RejectionReason::kNone) {
    out->relocalization.Consider(
        {.rejection = rejection, .map_key = hypothesis.map_key(), .inliers = result.inliers});
    if (map && !search.criteria.IsContradicted(result)) *missed = hypothesis;
    hypothesis.Clear();
    return Attempt::kGoOn;
  }
  if (const auto competitor = search.verification->BestCompetingMap(
          search.Query(&out->relocalization), search.retrieval->ByThumbnail(search.image, *search.finder),
          {hypothesis.map_key()})) {
    const std::uint64_t competitor_key = competitor->place.candidate.map_key;
    if (!IsUnambiguous(hypothesis.map_key(), result.Quality(), competitor_key, competitor->result.Quality(),
                       search.map_key)) {
      hypothesis.Clear();
      out->relocalization = {.rejection = RejectionReason::kAmbiguous,
                             .map_key = hypothesis.map_key(),
                             .competitor_key = competitor_key,
                             .inliers = result.inliers};
      return Attempt::kEnded;
    }
  }
  hypothesis.Confirm(result.camera_from_map);
  if (hypothesis.frames() < options_.confirming_frames) {
    out->relocalization = hypothesis.Unconfirmed(result);
    return Attempt::kEnded;
  }
  *found = FoundPose{FoundPose::How::kEntered, std::move(map), hypothesis.map_key(), result};
  hypothesis.Clear();
  return Attempt::kFound;
}

std::optional<FoundPose> Relocalizer::SearchPlaces(const PoseSearch& search, const MapHypothesis& missed,
                                                   TrackedFrame* out) {
  const auto query = search.Query(&out->relocalization);
  const auto go_on = [&](const std::vector<VerifiedPlace>& found) {
    return found.empty() && out->relocalization.rejection != RejectionReason::kAmbiguous;
  };
  const std::vector<AlignedPlace> by_thumbnail = search.retrieval->ByThumbnail(search.image, *search.finder);
  std::vector<VerifiedPlace> found = search.verification->Verify(query, by_thumbnail);
  // The places found by thumbnail remain as competitors.
  const auto verify_too = [&](std::vector<AlignedPlace> others) {
    if (others.empty()) return;
    others.insert(others.end(), by_thumbnail.begin(), by_thumbnail.end());
    found = search.verification->Verify(query, others);
  };
  // Visual words retrieve places whose thumbnails differ.
  if (go_on(found)) verify_too(search.retrieval->ByWords(search.image, *search.finder, by_thumbnail));
  // No keyframe is close enough for an alignment by rotation; descriptor matching works from further away.
  if (go_on(found))
    verify_too(search.retrieval->ByDescriptors(search.image, *search.finder, search.map_key, search.random));
  if (found.empty()) return std::nullopt;
  const auto key = [&](std::size_t i) { return found[i].place.candidate.map_key; };
  MapHypothesis& hypothesis = *search.hypothesis;
  // A camera that turns fast is far from its prediction, although the place is right. The last frame has to
  // be found from the prediction, so that two poses in a row agree closely.
  const auto resume = [&](const VerifiedPlace& place) {
    if (missed.exists() && missed.IsOfPlace(search.image, hypothesis.map_key(), place.result))
      hypothesis.Resume(missed, options_.confirming_frames - 1);
    out->relocalization = hypothesis.Unconfirmed(place.result);
  };
  const auto return_to = [&](const VerifiedPlace& place) {
    const auto pose = ReturnToMap(search, place, options_.poor_visible_ratio, &out->relocalization);
    if (hypothesis.exists()) resume(place);
    return pose;
  };
  if (found.size() > 1 &&
      !IsUnambiguous(key(0), found[0].result.Quality(), key(1), found[1].result.Quality(), search.map_key)) {
    // With an ambiguity the camera is assumed to be still in its map.
    const auto own = std::find_if(found.begin(), found.end(), [&](const VerifiedPlace& place) {
      return place.place.candidate.map_key == search.map_key;
    });
    if (own != found.end()) return return_to(*own);
    out->relocalization = {.rejection = RejectionReason::kAmbiguous,
                           .map_key = key(0),
                           .competitor_key = key(1),
                           .inliers = found[0].result.inliers};
    return std::nullopt;
  }
  if (key(0) == search.map_key) return return_to(found[0]);
  hypothesis.Begin(found[0]);
  resume(found[0]);
  return std::nullopt;
}

std::optional<FoundPose> Relocalizer::Search(const PoseSearch& search, TrackedFrame* out) {
  const bool known = search.map || !options_.build_maps;
  out->state = known ? TrackingState::kLost : TrackingState::kInitializing;
  out->hint = known ? Hint::kLookBack : Hint::kChooseMap;
  // The exposure or sharpness may have changed, so every other frame uses photometric tolerance. A hypothesis
  // is continued with the comparison that found it.
  if (!search.hypothesis->exists() && frames_lost_++ > 0) search.pose->AlternateComparison();
  std::optional<FoundPose> found;
  if (search.map && SearchNearby(search, out, &found) != Attempt::kGoOn) return found;
  MapHypothesis missed;
  if (!search.finder || ContinueHypothesis(search, &missed, out, &found) != Attempt::kGoOn) return found;
  // For a short time after the loss the same points are still occluded.
  if (options_.build_maps || !search.map ||
      search.image.time - lost_since_ > FromSeconds(options_.short_loss_s))
    search.pose->ForgetPatches();
  return SearchPlaces(search, missed, out);
}

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
// What the tracker passes to the mapper: keyframe candidates, initial pairs and statistics of its points.
#include <algorithm>
#include <utility>

#include "engine/tracking/reference_keyframe.h"
#include "engine/tracking/tracker.h"

namespace docent::engine {

void Tracker::ChooseKeyFrame(const Frame& frame, const MapTrackResult& result, const TrackedFrame& out) {
  const bool needs_six_dof = result.observed != ObservedMotion::kPanorama &&
                             NeedsKeyFrame(options_.keyframes, *map_, result.camera_from_map, result);
  KeyFrameChoice choice = needs_six_dof ? KeyFrameChoice::kSixDof : KeyFrameChoice::kNone;
  if (options_.hybrid) {
    // The panorama map that the pose comes from is the one to extend.
    if (keyframe_policy_.mode() == KeyFramePolicy::Mode::kSixDof &&
        result.observed == ObservedMotion::kPanorama) {
      if (const PanoramaMap* panorama = map_->FindPanorama(map_tracker_.panorama()))
        keyframe_policy_.Reopen(*panorama, *map_);
    }
    choice = keyframe_policy_.Select({.time = frame.time,
                                      .camera_from_map = result.camera_from_map,
                                      .observed = result.observed,
                                      .finite_coverage = result.finite_coverage,
                                      .coverage = result.coverage,
                                      .points = result.inliers,
                                      .median_depth = median_depth_,
                                      .needs_six_dof = needs_six_dof},
                                     *map_);
  }
  if (choice == KeyFrameChoice::kNone || frames_since_keyframe_ < options_.frames_between_keyframes) return;
  OfferKeyFrame(choice, frame, result.camera_from_map, out.matches);
}

void Tracker::OfferKeyFrame(KeyFrameChoice choice, const Frame& frame, const Rigid3& camera_from_map,
                            const std::vector<PointMatch>& matches) {
  KeyFrameCandidate candidate;
  candidate.choice = choice;
  candidate.panorama = map_tracker_.panorama();
  candidate.time = frame.time;
  if (map_) {
    candidate.map_revision = map_->revision;
    candidate.reference_keyframe = FindReferenceKeyFrame(*map_, matches);
  }
  candidate.camera = camera_;
  candidate.features = features_;
  candidate.camera_from_map = camera_from_map;
  for (const PointMatch& match : matches) {
    if (match.inlier) candidate.matches.push_back(match);
  }
  candidate_ = std::move(candidate);
  keyframe_policy_.Offered(choice, frame.time);
  if (starting_) keyframe_rotation_rates_.emplace_back(frame.time, rotation_rate_);
}

void Tracker::CollectReports() {
  if (!options_.build_maps) return;
  const auto earlier = [](const PointReport& a, const PointReport& b) { return a.point < b.point; };
  new_reports_.clear();
  for (const MapTracker::Attempt& attempt : map_tracker_.attempts()) {
    const PointReport wanted{.point = attempt.point};
    const auto known = std::lower_bound(reports_.begin(), reports_.end(), wanted, earlier);
    // Each point is attempted once per frame, so new reports need no search for duplicates.
    PointReport& report =
        known != reports_.end() && known->point == attempt.point ? *known : new_reports_.emplace_back(wanted);
    if (attempt.inlier) {
      ++report.inlier;
    } else if (attempt.found) {
      ++report.outlier;
    } else {
      ++report.not_found;
    }
  }
  std::sort(new_reports_.begin(), new_reports_.end(), earlier);
  // Merged from the back, in place: std::inplace_merge allocates.
  auto old = reports_.size(), fresh = new_reports_.size();
  reports_.resize(old + fresh);
  for (auto to = reports_.size(); fresh > 0;) {
    const bool old_is_later = old > 0 && earlier(new_reports_[fresh - 1], reports_[old - 1]);
    reports_[--to] = old_is_later ? reports_[--old] : new_reports_[--fresh];
  }
}

std::optional<KeyFrameCandidate> Tracker::TakeKeyFrameCandidate() {
  if (candidate_) frames_since_keyframe_ = 0;
  return std::exchange(candidate_, std::nullopt);
}

std::optional<InitialPair> Tracker::TakeInitialPair() {
  return std::exchange(pair_, std::nullopt);
}

std::vector<PointReport> Tracker::TakeReports() {
  return std::exchange(reports_, {});
}

}  // namespace docent::engine

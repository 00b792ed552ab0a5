// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/keyframe_offers.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/tracking/keyframe_novelty.h"
#include "engine/tracking/reference_keyframe.h"

namespace docent::engine {

namespace {

double FieldOfView(const CameraModel& camera) {
  const double middle = camera.height_px() / 2.0;
  const auto left = camera.Unproject({0, middle});
  const auto right = camera.Unproject({camera.width_px() - 1.0, middle});
  return left && right ? std::acos(std::clamp(left->dot(*right), -1.0, 1.0)) : 1.0;
}

}  // namespace

KeyFrameOffers::KeyFrameOffers(const TrackerOptions& options, const CameraModel& camera)
    : options_(options), policy_(options.keyframe_policy, FieldOfView(camera)) {}

void KeyFrameOffers::SetCamera(const CameraModel& camera) {
  policy_.SetFieldOfView(FieldOfView(camera));
}

void KeyFrameOffers::Restart() {
  policy_.Reset();
  awaits_accepted_ = false;
  localized_.image = {};
}

void KeyFrameOffers::Reset() {
  Restart();
  candidate_.reset();
  taken_.reset();
  accepted_.reset();
}

void KeyFrameOffers::BeginFrame() {
  candidate_.reset();
  taken_.reset();
  ++frames_since_keyframe_;
}

void KeyFrameOffers::Consider(const CameraImage& image, const MapSnapshot& map, const TrackedPose& pose) {
  const MapTrackResult& result = pose.result;
  const bool needs_six_dof = result.observed != ObservedMotion::kPanorama &&
                             NeedsKeyFrame(options_.keyframes, map, result.camera_from_map, result);
  KeyFrameChoice choice = needs_six_dof ? KeyFrameChoice::kSixDof : KeyFrameChoice::kNone;
  if (options_.hybrid) {
    // The panorama map that the pose comes from is the one to extend.
    if (policy_.mode() == KeyFramePolicy::Mode::kSixDof && result.observed == ObservedMotion::kPanorama) {
      if (const PanoramaMap* panorama = map.FindPanorama(pose.panorama)) policy_.Reopen(*panorama, map);
    }
    choice = policy_.Select({.time = image.time,
                             .camera_from_map = result.camera_from_map,
                             .observed = result.observed,
                             .finite_coverage = result.finite_coverage,
                             .coverage = result.coverage,
                             .points = result.inliers,
                             .median_depth = pose.median_depth,
                             .needs_six_dof = needs_six_dof},
                            map);
    if (result.observed != ObservedMotion::kPanorama) Remember(image, map, pose);
    if (result.inliers == 0 && choice == KeyFrameChoice::kNone) return OfferLastLocalized(image.time, map);
  }
  if (choice == KeyFrameChoice::kNone || IsTooEarly(map, result.inliers)) return;
  Offer(choice, image, &map, result.camera_from_map, pose.matches, pose.panorama);
}

// Until the map has the last keyframe, the next one would be chosen as if that one did not exist. A camera
// that moves so fast that its points leave the image cannot wait longer than that.
bool KeyFrameOffers::IsTooEarly(const MapSnapshot& map, int inliers) const {
  const auto has_keyframe = [&](const auto& is_expected) {
    return std::any_of(map.keyframes.rbegin(), map.keyframes.rend(), is_expected);
  };
  if (frames_since_keyframe_ < options_.frames_between_keyframes) {
    return !accepted_ || inliers >= options_.min_kept_ratio * accepted_->inliers ||
           !has_keyframe([&](const KeyFrame& keyframe) { return keyframe.time == accepted_->time; });
  }
  if (!awaits_accepted_ || frames_since_keyframe_ >= options_.max_frames_without_keyframe) return false;
  // It may have been removed since as redundant, and the times of a map from the library are of another
  // clock.
  return !has_keyframe([&](const KeyFrame& keyframe) {
    return keyframe.id >= accepted_->first_new && keyframe.time >= accepted_->time;
  });
}

void KeyFrameOffers::Remember(const CameraImage& image, const MapSnapshot& map, const TrackedPose& pose) {
  localized_.image = image;
  localized_.image.previous = nullptr;
  localized_.camera_from_map = pose.result.camera_from_map;
  localized_.matches.assign(pose.matches.begin(), pose.matches.end());
  localized_.map_revision = map.revision;
  localized_.median_depth = pose.median_depth;
}

// A camera that turns fast may see none of the points that it saw in the frame before.
void KeyFrameOffers::OfferLastLocalized(Timestamp now, const MapSnapshot& map) {
  // Later, the images overlap too little for points of one to be found in the other.
  constexpr Timestamp kMaxAge = std::chrono::milliseconds(200);
  if (!localized_.image.features || now - localized_.image.time > kMaxAge ||
      policy_.mode() != KeyFramePolicy::Mode::kSixDof ||
      policy_.PanoramaNear(localized_.camera_from_map, localized_.median_depth, map) != kNoId)
    return;
  Offer(KeyFrameChoice::kLocalizedPanorama, localized_.image, &map, localized_.camera_from_map,
        localized_.matches, kNoId);
  candidate_->map_revision = localized_.map_revision;
}

void KeyFrameOffers::OfferFirst(const CameraImage& image) {
  Offer(KeyFrameChoice::kFirst, image, nullptr, Rigid3(), {}, kNoId);
}

void KeyFrameOffers::Offer(KeyFrameChoice choice, const CameraImage& image, const MapSnapshot* map,
                           const Rigid3& camera_from_map, const std::vector<PointMatch>& matches,
                           PanoramaId panorama) {
  KeyFrameCandidate candidate;
  candidate.choice = choice;
  candidate.panorama = panorama;
  candidate.time = image.time;
  first_new_ = map ? map->next_keyframe : 0;
  if (map) {
    candidate.map_revision = map->revision;
    candidate.reference_keyframe = FindReferenceKeyFrame(*map, matches);
  }
  candidate.camera = image.camera;
  candidate.features = image.features;
  candidate.camera_from_map = camera_from_map;
  for (const PointMatch& match : matches) {
    if (match.inlier) candidate.matches.push_back(match);
  }
  candidate_ = std::move(candidate);
}

std::optional<KeyFrameCandidate> KeyFrameOffers::Take() {
  if (candidate_)
    taken_ = Taken{candidate_->choice, candidate_->time, static_cast<int>(candidate_->matches.size()),
                   candidate_->camera, first_new_};
  return std::exchange(candidate_, std::nullopt);
}

std::optional<Timestamp> KeyFrameOffers::Accept() {
  if (!taken_) return std::nullopt;
  frames_since_keyframe_ = 0;
  policy_.Accepted(taken_->choice, taken_->time, taken_->camera);
  accepted_ = std::exchange(taken_, std::nullopt);
  awaits_accepted_ = true;
  return accepted_->time;
}

}  // namespace docent::engine

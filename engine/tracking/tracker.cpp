// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/tracker.h"

#include <algorithm>
#include <utility>

#include "engine/base/option_check.h"

namespace docent::engine {

namespace {

CameraState TrackedState(const RelocalizationConfirmation& confirmation) {
  return confirmation.is_pending() ? CameraState::kRelocalized : CameraState::kTracked;
}

}  // namespace

Tracker::Tracker(const TrackerOptions& options, std::shared_ptr<const CameraModel> camera, std::uint64_t seed)
    : options_(Checked(options)),
      criteria_(options),
      camera_(std::move(camera)),
      random_(seed),
      extractor_(options.features),
      pose_(options, camera_),
      initialization_(options, camera_, random_.Next(), seed),
      offers_(options, *camera_),
      retrieval_(options),
      verification_(options, camera_),
      relocalizer_(options),
      better_maps_(options),
      confirmation_(options),
      odometry_(options, camera_) {
  odometry_.SetRim(&extractor_.rim());
  pose_.SetRim(&extractor_.rim());
  verification_.SetRim(&extractor_.rim());
}

void Tracker::SetCamera(std::shared_ptr<const CameraModel> camera) {
  if (camera == camera_) return;
  camera_ = std::move(camera);
  pose_.SetCamera(camera_);
  verification_.SetCamera(camera_);
  initialization_.SetCamera(camera_, &random_);
  offers_.SetCamera(*camera_);
  odometry_.SetCamera(camera_);
}

void Tracker::Reset() {
  state_ = CameraState::kNoMap;
  map_.reset();
  map_key_ = 0;
  search_known_maps_ = false;
  initialization_.Stop();
  pose_.Reset();
  hypothesis_ = {};
  relocalizer_.Reset();
  confirmation_.Reset();
  offers_.Reset();
  odometry_.Reset();
  reports_.Clear();
}

void Tracker::StartNewMap(bool search_known_maps) {
  Reset();
  initialization_.Begin();
  initializes_stored_map_ = false;
  state_ = CameraState::kStarting;
  search_known_maps_ = search_known_maps;
}

void Tracker::InitializeTrackedMap() {
  if (!map_ || map_->HasFinitePoints() || !IsTracked(state_) || initialization_.is_on()) return;
  initialization_.Begin();
  initializes_stored_map_ = true;
}

void Tracker::SetMap(std::shared_ptr<const MapSnapshot> map, std::uint64_t map_key) {
  const bool same = map_key == map_key_;
  if (same && map_ && map) pose_.ApplyCorrections(*map_, *map, IsTracked(state_));
  map_ = map && !map->keyframes.empty() ? std::move(map) : nullptr;
  map_key_ = map_ ? map_key : 0;
  if (!map_) {
    state_ = initialization_.is_on() ? CameraState::kStarting : CameraState::kNoMap;
    return;
  }
  if (initialization_.is_on() && !map_->HasFinitePoints()) {
    // The mapper made a panorama map of this tracker's first image.
    if (same) return;
    const KeyFrame& first = map_->keyframes.front();
    pose_.Begin(first.time, first.camera_from_map, ObservedMotion::kPanorama);
    initialization_.FirstIsMapped(first.time, first.camera_from_map);
    offers_.FirstIsMapped(first);
    state_ = TrackedState(confirmation_);
    relocalizer_.LoseLongAgo();
  } else if (initialization_.phase() == MapInitialization::Phase::kPairGiven) {
    // The mapper made a map of this tracker's pair: its newest keyframe is the latest known pose. Another
    // camera may have added one since.
    initialization_.Finish();
    offers_.Restart();
    const auto own =
        std::find_if(map_->keyframes.rbegin(), map_->keyframes.rend(), [this](const KeyFrame& k) {
          return k.kind == KeyFrameKind::kSixDof && k.camera->HasSameLens(*camera_);
        });
    const KeyFrame& newest = own == map_->keyframes.rend() ? map_->keyframes.back() : *own;
    // The mapper took its time, and the camera may have rotated meanwhile.
    pose_.BeginWithDepth(newest.time, newest.camera_from_map, same && IsTracked(state_));
    state_ = TrackedState(confirmation_);
  } else if (!same) {
    pose_.Reset();
    offers_.Restart();
    odometry_.Reset();
    reports_.Clear();
    confirmation_.EnterOtherMap();
    state_ = CameraState::kLost;
    relocalizer_.LoseLongAgo();
  } else if (initialization_.is_on()) {
    initialization_.Stop();  // another camera gave the map its depth
  }
}

TrackedFrame Tracker::Track(const Frame& frame, const PlaceFinder* places) {
  TrackedFrame out;
  Track(frame, places, &out);
  return out;
}

void Tracker::Track(const Frame& frame, const PlaceFinder* places, TrackedFrame* out) {
  const auto start = std::chrono::steady_clock::now();
  std::vector<PointMatch> matches = std::move(out->matches);
  matches.clear();
  *out = TrackedFrame();
  out->matches = std::move(matches);
  out->frame = frame;
  initialization_.BeginFrame();
  offers_.BeginFrame();
  odometry_.BeginFrame();
  // After an interruption the camera may be anywhere.
  if ((IsTracked(state_) || odometry_.is_active()) &&
      frame.time - image_.time > FromSeconds(options_.short_loss_s)) {
    pose_.Lose(frame.time);
    odometry_.Reset();
    relocalizer_.Lose(frame.time);
    relocalizer_.LoseLongAgo();
    state_ = CameraState::kLost;
  }
  image_.time = frame.time;
  image_.camera = camera_;
  image_.previous = std::exchange(image_.features, nullptr);
  image_.features = extractor_.Extract(frame.image);
  image_.is_repeated = image_.previous && AreEqual(*image_.previous, *image_.features);
  searched_ = map_ && IsTracked(state_);
  corners_ = initialization_.FollowCorners(image_);

  switch (state_) {
    case CameraState::kStarting:
      SearchInitialPair(out);
      break;
    case CameraState::kTracked:
    case CameraState::kRelocalized:
      TrackMap(frame, places, out);
      if (HasPose(out->state) && places) SearchBetterMaps(*places, out);
      break;
    case CameraState::kNoMap:
    case CameraState::kLost:
      SearchLost(frame, places, out);
      break;
  }
  // Another place that looks alike must not give a map that was there before its depth.
  if (initializes_stored_map_ && confirmation_.is_pending()) {
    initialization_.ForgetViews();
  } else if (initialization_.is_on() && map_) {
    SearchInitialPair(out);
  }
  out->tracking_time = std::chrono::steady_clock::now() - start;
}

// A panorama map may be tracked at the same time.
void Tracker::SearchInitialPair(TrackedFrame* out) {
  const bool offers_first = !map_ && options_.hybrid && options_.build_maps &&
                            initialization_.phase() == MapInitialization::Phase::kSearching;
  initialization_.SetReadout(pose_.readout_s());
  initialization_.Search(image_, map_.get(), pose_.map_tracker().panorama(), pose_.rotation_rate(), out);
  if (offers_first) offers_.OfferFirst(image_);
}

void Tracker::TrackMap(const Frame& frame, const PlaceFinder* places, TrackedFrame* out) {
  const PoseTracker::Estimate estimate =
      pose_.Track(*map_, image_, frame.commanded_rotation, offers_.policy(), &random_);
  image_.camera = pose_.image_camera();
  using Outcome = PoseTracker::Estimate::Outcome;
  // The map is not extended while a pose that was found after a loss waits for confirmation. A camera that
  // then sees nothing of the map has left it, or never was there; the rotation of the image alone would hide
  // that.
  const bool left_unconfirmed =
      estimate.outcome == Outcome::kRotationOnly && options_.build_maps && confirmation_.is_pending();
  // Where the map has few points, or only the rotation is known, a pose that comes from the points of the
  // visit as well is more certain.
  std::optional<MapTrackResult> continued;
  const bool certain = estimate.outcome == Outcome::kPose &&
                       estimate.result.finite_inliers >= options_.min_relocalization_inliers;
  if (!options_.build_maps && !certain) {
    odometry_.Begin(pose_);
    frames_of_odometry_ = 0;
    if (odometry_.is_active() && estimate.outcome != Outcome::kLost)
      continued = odometry_.Track(image_, frame.commanded_rotation, &random_);
  }
  if (!continued && (estimate.outcome == Outcome::kPose ||
                     (estimate.outcome == Outcome::kRotationOnly && !left_unconfirmed))) {
    out->state = TrackingState::kSixDof;
    Accept(estimate.result, out);
    if (estimate.outcome == Outcome::kRotationOnly) out->hint = Hint::kLowTexture;
    return;
  }
  pose_.Lose(image_.time);
  relocalizer_.Lose(image_.time);
  state_ = CameraState::kLost;
  out->state = TrackingState::kLost;
  out->hint = Hint::kLeftMap;
  out->left_map = estimate.outcome == Outcome::kLeftMap || left_unconfirmed;
  // The same image may be recognized, so that unexpected motion does not cost a frame.
  if (estimate.outcome == Outcome::kLost) Use(relocalizer_.Search(SearchIn(places), out), out);
  if (HasPose(out->state)) return;
  if (!continued && odometry_.is_active())
    continued = odometry_.Track(image_, frame.commanded_rotation, &random_);
  ContinueByOdometry(continued, out);
}

void Tracker::SearchLost(const Frame& frame, const PlaceFinder* places, TrackedFrame* out) {
  // With visual odometry the camera is near the predicted pose, and other places are searched about four
  // times a second: odometry needs the images in between, and a search takes as long as several of them.
  constexpr unsigned kInterval = 8;
  const bool odometry = odometry_.is_active();
  const bool everywhere =
      !odometry_.has_pose() || hypothesis_.exists() || ++frames_of_odometry_ % kInterval == 0;
  Use(relocalizer_.Search(SearchIn(everywhere ? places : nullptr), out), out);
  if (!odometry || HasPose(out->state)) return;
  ContinueByOdometry(odometry_.Track(image_, frame.commanded_rotation, &random_), out);
  if (!HasPose(out->state)) Use(relocalizer_.Search(SearchIn(places), out), out);
}

void Tracker::ContinueByOdometry(const std::optional<MapTrackResult>& result, TrackedFrame* out) {
  if (!result) return;
  pose_.Follow(odometry_.pose(), image_.time);
  relocalizer_.StayNear(image_.time);
  out->state = TrackingState::kSixDof;
  out->by_odometry = true;
  out->left_map = false;
  const bool good = criteria_.IsGood(*result);
  out->hint = good ? Hint::kNone : Hint::kMoveMoreSlowly;
  SetPose(*result, good, out);
}

PoseSearch Tracker::SearchIn(const PlaceFinder* places) {
  return {.image = image_,
          .finder = places,
          .map = map_,
          .map_key = map_key_,
          .policy = offers_.policy(),
          .criteria = criteria_,
          .pose = &pose_,
          .retrieval = &retrieval_,
          .verification = &verification_,
          .hypothesis = &hypothesis_,
          .random = &random_,
          .has_odometry = odometry_.has_pose()};
}

void Tracker::SearchBetterMaps(const PlaceFinder& places, TrackedFrame* out) {
  Use(better_maps_.SearchOtherPlace(SearchIn(&places), confirmation_.is_pending(),
                                    confirmation_.visible_inlier_ratio(), out),
      out);
  if (!options_.build_maps) {
    Use(better_maps_.SearchOverlappingMap(SearchIn(&places), confirmation_.visible_inlier_ratio(), *out),
        out);
  }
  if (!search_known_maps_) return;
  const auto found = better_maps_.SearchKnownMaps(SearchIn(&places));
  if (!found) return;
  search_known_maps_ = false;
  initialization_.Stop();
  offers_.Withdraw();
  Use(found, out);
}

void Tracker::Use(const std::optional<FoundPose>& found, TrackedFrame* out) {
  if (!found) return;
  if (found->how != FoundPose::How::kNearby) odometry_.Reset();
  const bool entered = found->how == FoundPose::How::kEntered;
  if (entered) {
    if (found->map_key != map_key_) {
      confirmation_.EnterOtherMap();
      // A pair of views of the map that was left must not start one here.
      initialization_.Stop();
      offers_.Withdraw();
      search_known_maps_ = false;
    }
    map_ = found->map;
    map_key_ = found->map_key;
    reports_.Clear();
  }
  // From visual odometry, the camera returns to the points of the map without having been lost.
  const bool was_lost = !odometry_.has_pose();
  out->state = was_lost ? TrackingState::kRelocalized : TrackingState::kSixDof;
  if (found->how != FoundPose::How::kNearby || !was_lost) out->hint = Hint::kNone;
  Accept(found->result, out);
  if (entered) confirmation_.CountHypothesis();
}

void Tracker::Accept(const MapTrackResult& result, TrackedFrame* out) {
  const bool good = criteria_.IsGood(result);
  const bool relocalized = out->state == TrackingState::kRelocalized;
  bool may_extend = false;
  if (relocalized) {
    confirmation_.Begin(result, {.duration = image_.time - relocalizer_.lost_since(),
                                 .lost = pose_.last(),
                                 .found = result.camera_from_map,
                                 .median_depth = pose_.median_depth()});
    better_maps_.Restart();
    relocalizer_.Succeed();
    hypothesis_ = {};  // of the loss that ends here
    offers_.Restart();
  } else {
    may_extend = confirmation_.Add(result, good);
  }
  pose_.Accept(image_, result, relocalized);
  state_ = TrackedState(confirmation_);
  SetPose(result, good, out);
  const MapTracker& tracked = pose_.map_tracker();
  const bool from_points = result.inliers > 0;
  if (from_points) {
    out->matches = tracked.matches();
    if (may_extend && options_.build_maps) reports_.Add(tracked.attempts());
  }
  if (!good) out->hint = Hint::kMoveMoreSlowly;
  if ((good || !from_points) && may_extend && options_.build_maps)
    offers_.Consider(image_, *map_, {result, out->matches, tracked.panorama(), pose_.median_depth()});
  if (!options_.build_maps && from_points)
    odometry_.AddMapPose(image_, *map_,
                         {.tracked = {result, out->matches, tracked.panorama(), pose_.median_depth()},
                          .good = good,
                          .rotation_center = pose_.has_rotation_center()});
}

void Tracker::SetPose(const MapTrackResult& result, bool good, TrackedFrame* out) const {
  if (out->state != TrackingState::kRelocalized) {
    if (result.observed == ObservedMotion::kHybrid) out->state = TrackingState::kHybrid;
    if (result.observed == ObservedMotion::kPanorama) out->state = TrackingState::kPanorama;
  }
  out->relocalization = {};
  out->map = map_;
  out->map_key = map_key_;
  out->camera_from_map = result.camera_from_map;
  out->covariance = result.covariance;
  out->quality = result.Quality();
  out->quality_class = good ? TrackingQuality::kGood : TrackingQuality::kPoor;
  out->finite_points = result.finite_inliers;
  out->infinite_points = result.inliers - result.finite_inliers;
}

void Tracker::KeyFrameAccepted() {
  if (!options_.build_maps) {
    odometry_.offers().Accept();
    return;
  }
  if (const auto time = offers_.Accept()) initialization_.AddKeyFrame(*time, pose_.rotation_rate());
}

FrameInspection Tracker::Inspect(const TrackedFrame& tracked) const {
  FrameInspection inspection;
  // After a failed relocalization the searched map may no longer exist.
  if (HasPose(tracked.state)) {
    inspection = pose_.map_tracker().Inspect(tracked.camera_from_map);
  } else if (searched_) {
    inspection = pose_.map_tracker().Inspect(pose_.last());
  }
  inspection.features = image_.features;
  return inspection;
}

}  // namespace docent::engine

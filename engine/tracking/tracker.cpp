// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/tracker.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "engine/vision/rotation_alignment.h"

namespace docent::engine {

namespace {

double FieldOfView(const CameraModel& camera) {
  const double middle = camera.height_px() / 2.0;
  const auto left = camera.Unproject({0, middle});
  const auto right = camera.Unproject({camera.width_px() - 1.0, middle});
  return left && right ? std::acos(std::clamp(left->dot(*right), -1.0, 1.0)) : 1.0;
}

// A small share of the points tells a pose where they fit it. Measured with images that differ from the
// map's: right poses leave 0.8 to 1.1; of those by less than a fifth of the points, and 1.0 or more, some had
// jumped by a third of a metre.
bool FitsWell(const MapTrackResult& result) {
  constexpr double kSmallShare = 0.2;
  constexpr double kMaxSigma = 1.5, kMaxSigmaOfSmallShare = 0.8;
  return result.sigma <= (result.Quality() >= kSmallShare ? kMaxSigma : kMaxSigmaOfSmallShare);
}

constexpr Timestamp kLongAgo = -std::chrono::hours(24 * 365 * 50);  // from which any time may be subtracted

}  // namespace

Tracker::Tracker(const TrackerOptions& options, std::shared_ptr<const CameraModel> camera, std::uint64_t seed)
    : options_(options),
      camera_(std::move(camera)),
      random_(seed),
      map_tracker_(options.map_tracker, camera_),
      competing_tracker_(options.map_tracker, camera_),
      initializer_(options.initializer, camera_, random_.Next()),
      selector_(options.selector, FieldOfView(*camera_)),
      rotation_center_(options.rotation_center) {
  if (options.target) target_initializer_.emplace(options.target, options.target_start, camera_, seed);
}

void Tracker::ResetStart() {
  initializer_.Reset();
  if (target_initializer_) target_initializer_->Reset();
}

Timestamp Tracker::FirstViewTime() const {
  return target_initializer_ ? target_initializer_->first_time() : initializer_.first_time();
}

std::optional<InitialPair> Tracker::TrackStart(const Frame& frame, std::string* hint) {
  std::optional<InitialPair> pair;
  if (target_initializer_) {
    if (auto start = target_initializer_->Track(frame.time, features_)) pair = std::move(start->pair);
    *hint = target_initializer_->hint();
  } else {
    pair = initializer_.Track(frame.time, features_);
    *hint = initializer_.hint();
  }
  return pair;
}

void Tracker::Reset() {
  map_.reset();
  map_key_ = 0;
  starting_ = pair_given_ = tracking_ = search_known_maps_ = false;
  anchor_.reset();
  rotation_center_.Reset();
  turn_ = {};
  hypothesis_key_ = leader_key_ = 0;
  hypothesis_frames_ = leader_frames_ = doubtful_frames_ = 0;
  ResetStart();
  map_tracker_.Clear();
  map_tracker_.EnablePanorama(kNoId);
  selector_.Reset();
  reports_.clear();
  candidate_.reset();
  pair_.reset();
  keyframe_turn_rates_.clear();
}

void Tracker::StartFailed() {
  pair_given_ = false;
}

void Tracker::StartNewMap(bool search_known_maps) {
  Reset();
  starting_ = true;
  search_known_maps_ = search_known_maps;
}

void Tracker::SetMap(std::shared_ptr<const MapSnapshot> map, std::uint64_t map_key) {
  const bool same = map_key == map_key_;
  if (same && map_ && map) FollowCorrections(*map);
  map_ = map && !map->keyframes.empty() ? std::move(map) : nullptr;
  map_key_ = map_ ? map_key : 0;
  if (!map_) {
    tracking_ = false;
    return;
  }
  if (starting_ && !map_->HasFinitePoints()) {
    // Our own first image became a map of directions.
    if (same && tracking_) return;
    const KeyFrame& first = map_->keyframes.front();
    map_tracker_.Clear();
    motion_.Reset(first.time, first.camera_from_map);
    // The corners that are followed must begin where the pose is known.
    first_view_from_map_ = first.camera_from_map;
    if (FirstViewTime() != first.time) ResetStart();
    selector_.Offered(KeyFrameChoice::kFirst, first.time);
    observed_ = ObservedMotion::kPanorama;
    tracking_ = true;
    lost_since_ = kLongAgo;
  } else if (pair_given_) {
    // Our own pair became a map: its newest keyframe is where the camera was a moment ago.
    starting_ = pair_given_ = false;
    map_tracker_.Clear();
    map_tracker_.EnablePanorama(kNoId);
    selector_.Reset();
    motion_.Reset(map_->keyframes.back().time, map_->keyframes.back().camera_from_map);
    observed_ = ObservedMotion::kSixDof;
    tracking_ = true;
  } else if (!same) {
    map_tracker_.EnablePanorama(kNoId);
    selector_.Reset();
    rotation_center_.Reset();
    turn_ = {};
    map_tracker_.Clear();
    reports_.clear();
    anchor_.reset();
    mean_visible_inlier_ratio_ = 1;
    tracking_ = false;
    lost_since_ = kLongAgo;
  }
}

std::shared_ptr<ImageFeatures> Tracker::NextFeatures(const Frame& frame) {
  std::shared_ptr<ImageFeatures> features;
  for (const auto& pooled : pool_) {
    // Keyframes keep theirs; what nobody else holds is written again.
    if (pooled.use_count() == 1) {
      features = pooled;
      break;
    }
  }
  if (!features) {
    std::erase_if(pool_, [](const auto& pooled) { return pooled.use_count() == 1; });
    if (pool_.size() > 8) pool_.erase(pool_.begin());
    features = std::make_shared<ImageFeatures>();
    pool_.push_back(features);
  }
  cv::Mat gray;
  if (frame.image.channels() == 1) {
    gray = frame.image;
  } else {
    gray = features->levels[0];
    cv::cvtColor(frame.image, gray, cv::COLOR_BGR2GRAY);
  }
  ExtractFeatures(gray, options_.features, fast_threshold_, features.get());
  fast_threshold_ = features->fast_threshold;
  return features;
}

std::optional<Rotation3> Tracker::RotationFromPrevious() const {
  if (!previous_) return std::nullopt;
  const auto aligned = AlignRotation(previous_->small_blurry, *camera_, features_->small_blurry, *camera_);
  if (!aligned || !aligned->converged) return std::nullopt;
  return aligned->b_from_a;
}

bool Tracker::IsAccepted(const MapTrackResult& result) const {
  const bool sure = result.observed == ObservedMotion::kPanorama || result.Quality() >= options_.sure_quality;
  const int min_inliers = sure ? options_.min_sure_inliers : options_.min_inliers;
  // What is compared tolerantly is found by chance more often, and visitors must not see exhibits jump.
  const bool strict = comparison_ == PatchComparison::kTolerant || !options_.build_maps;
  const bool fits = !strict || result.Quality() >= options_.good_quality || FitsWell(result);
  return fits && result.converged && result.sigma <= options_.max_sigma && result.inliers >= min_inliers &&
         result.occupied_cells >= options_.min_cells &&
         (result.Quality() >= options_.lost_quality || HasWideConsensus(result));
}

// Whether so many points agree on the pose that it is right whatever else was looked for in vain.
bool Tracker::HasWideConsensus(const MapTrackResult& result) const {
  return result.inliers >= options_.min_consensus_inliers && result.sigma <= options_.max_consensus_sigma &&
         result.inliers >= options_.min_consensus_ratio * result.found;
}

// Where a visitor's camera sees few points of the map, as its lens shows a small part of it or its images
// differ, few tell the pose nevertheless when they fit. Only where the camera was a moment ago: by such a
// pose no place is recognised, and no map grows.
bool Tracker::HoldsTrack(const MapTrackResult& result) const {
  if (options_.build_maps || !result.converged || result.observed != ObservedMotion::kSixDof) return false;
  if (result.occupied_cells < options_.min_recovery_cells || result.Quality() < options_.lost_quality)
    return false;
  if (result.inliers >= options_.min_inliers) return FitsWell(result);
  return result.inliers >= options_.min_tight_inliers && result.sigma <= options_.max_tight_sigma;
}

// Whether a turn, if it is one that the result tells of, explains what was seen.
bool Tracker::IsTurn(const MapTrackResult& result, const MapSnapshot& map) const {
  return result.observed != ObservedMotion::kPanorama || !map.HasFinitePoints() ||
         result.sigma <= options_.max_turn_sigma;
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
  candidate_.reset();
  pair_.reset();
  previous_ = std::exchange(features_, nullptr);
  features_ = NextFeatures(frame);
  ++frames_since_keyframe_;
  searched_ = map_ && tracking_;

  if (starting_ && !map_) {
    SearchInitialPair(frame, out);
  } else if (tracking_) {
    TrackMap(frame, places, out);
    if (HasPose(out->state) && places) {
      SearchBetterPlace(frame, *places, out);
      if (!options_.build_maps) SearchBetterMap(frame, *places, out);
      if (search_known_maps_) SearchKnownMaps(frame, *places, out);
    }
  } else {
    Recover(frame, places, out);
  }
  if (starting_ && map_) SearchInitialPair(frame, out);
  out->tracking_time = std::chrono::steady_clock::now() - start;
}

// Follows corners for two views that start a map; beside it a map of directions may already be tracked.
void Tracker::SearchInitialPair(const Frame& frame, TrackedFrame* out) {
  if (!map_) out->state = TrackingState::kInitializing;
  if (pair_given_) {
    if (!map_) out->hint = "hold on, making a map";
    return;
  }
  const bool posed = HasPose(out->state);
  if (map_ && !posed) {
    // The first view's pose would be lost with the track.
    ResetStart();
    return;
  }
  const bool directions = options_.hybrid && options_.build_maps;
  if (!map_ && directions) ResetStart();  // its first view is to be the map's, too
  pair_ = TrackStart(frame, &out->hint);
  if (pair_) pair_->a_from_map = first_view_from_map_;
  if (!pair_ && posed && directions && !target_initializer_) pair_ = TryPanoramaViews(frame, *out);
  if (pair_) pair_given_ = true;
  if (FirstViewTime() == frame.time) first_view_from_map_ = posed ? out->camera_from_map : Rigid3();
  if (!map_ && directions) OfferKeyFrame(KeyFrameChoice::kFirst, frame, Rigid3(), {});
}

// The panorama map whose points are looked for: the one that is open, or one whose centre the camera is back
// in when the map of finite points does not fill the image.
PanoramaId Tracker::PanoramaFor(const Rigid3& predicted) const {
  if (map_->panoramas.empty()) return kNoId;
  if (selector_.mode() == KeyFramePolicy::Mode::kPanorama) return selector_.OpenPanorama(*map_);
  const bool needed =
      observed_ == ObservedMotion::kPanorama || finite_coverage_ < options_.selector.min_coverage;
  return needed ? selector_.PanoramaNear(predicted, median_depth_, *map_) : kNoId;
}

void Tracker::Compare(PatchComparison comparison) {
  comparison_ = comparison;
  map_tracker_.Compare(comparison);
  competing_tracker_.Compare(comparison);
}

MapTrackResult Tracker::TrackFrom(const Rigid3& predicted) {
  const auto track = [&] {
    return map_tracker_.Track(*map_, *features_, predicted, MapTracker::Effort::kStandard, &random_);
  };
  if (comparison_ == PatchComparison::kStandard) {
    const MapTrackResult result = track();
    // What differed may do so again.
    if (frames_tolerant_ == 0 || result.Quality() >= options_.good_quality) return result;
    Compare(PatchComparison::kTolerant);
    return track();
  }
  // Ever more seldom, as it costs as much as the frame itself.
  constexpr unsigned kSeldom = 32;
  ++frames_tolerant_;
  if (std::has_single_bit(frames_tolerant_) || frames_tolerant_ % kSeldom == 0) {
    Compare(PatchComparison::kStandard);
    const MapTrackResult result = track();
    if (IsAccepted(result) && result.inliers >= options_.standard_share * inliers_) return result;
    Compare(PatchComparison::kTolerant);
  }
  return track();
}

void Tracker::EnterLostState(const Frame& frame, TrackedFrame* out) {
  map_tracker_.Forget();
  tracking_ = false;
  misfit_frames_ = 0;
  lost_since_ = frame.time;
  frames_lost_ = 0;
  motion_.Miss(frame.time);
  out->state = TrackingState::kLost;
  out->hint = "look back at what was mapped";
}

void Tracker::TrackMap(const Frame& frame, const PlaceFinder* places, TrackedFrame* out) {
  // What was commanded is known better than what was observed before.
  Rigid3 predicted = frame.turned ? motion_.PredictWithRotation(*frame.turned) : motion_.Predict(frame.time);
  if (observed_ == ObservedMotion::kPanorama)
    predicted = RotatedAbout(turn_.pivot, motion_.last(), predicted.rotation);
  map_tracker_.EnablePanorama(PanoramaFor(predicted));
  map_tracker_.SetRotationPrior(turn_);
  MapTrackResult result = TrackFrom(predicted);
  if (!IsAccepted(result)) {
    // A second try, wider and turned as the whole image turned.
    const auto rotation = RotationFromPrevious();
    const Rigid3 turned = rotation ? motion_.PredictWithRotation(*rotation) : predicted;
    result = map_tracker_.Track(*map_, *features_, turned, MapTracker::Effort::kWide, &random_);
  }
  if (!IsAccepted(result) && !HoldsTrack(result)) {
    map_tracker_.Forget();
    if (options_.hybrid && TrackRotationDirectly(frame, result, out)) return;
    EnterLostState(frame, out);
    // The same image may show a place that is recognised: a surprising motion need not cost a frame.
    Recover(frame, places, out);
    return;
  }
  misfit_frames_ = IsTurn(result, *map_) ? 0 : misfit_frames_ + 1;
  if (misfit_frames_ >= options_.frames_of_misfit) {
    EnterLostState(frame, out);
    out->hint = "you have walked where nothing is mapped: look back";
    return;
  }
  out->state = TrackingState::kSixDof;
  Accept(frame, result, out);
}

// On a bare wall there are edges and shades, but hardly a corner: the whole image still tells how the
// camera has turned (ptamm §3.2). Only where few points are to be expected, or are there; where many are and
// fail, the pose is wrong.
bool Tracker::TrackRotationDirectly(const Frame& frame, const MapTrackResult& tried, TrackedFrame* out) {
  // A map of directions alone claims nothing but turns.
  const bool bare = tried.attempted <= options_.low_texture_points ||
                    tried.Quality() >= options_.sure_quality || !map_->HasFinitePoints();
  if (!anchor_ || !bare || frame.time - last_points_ > FromSeconds(options_.max_image_s)) return false;
  const SmallBlurryImage& image = features_->small_blurry;
  const double spread = cv::norm(image.pixels, cv::NORM_L2SQR) / static_cast<double>(image.pixels.total());
  const Rotation3 predicted = motion_.Predict(frame.time).rotation;
  std::optional<RotationAlignment> turn;
  const auto align = [&] {
    turn = AlignRotation(anchor_->small_blurry, *camera_, image, *camera_,
                         predicted * anchor_pose_.rotation.inverse(), 10, turn_.pivot / median_depth_);
    return turn && turn->converged && turn->overlap >= options_.min_image_overlap &&
           turn->rms * turn->rms <= (1 - options_.min_image_agreement) * spread;
  };
  // The older the image that the turn is measured from, the less errors add up; the newer, the more it has
  // in common with this one.
  if (!align()) {
    if (!previous_ || anchor_ == previous_) return false;
    anchor_ = previous_;
    anchor_pose_ = motion_.last();
    if (!align()) return false;
  }
  MapTrackResult result;
  result.camera_from_map = RotatedAbout(turn_.pivot, anchor_pose_, turn->b_from_a * anchor_pose_.rotation);
  result.observed = ObservedMotion::kPanorama;
  result.attempted = tried.attempted;
  Accept(frame, result, out);
  out->hint = "a bare place: only turns are followed";
  return true;
}

void Tracker::Accept(const Frame& frame, const MapTrackResult& result, TrackedFrame* out) {
  const bool good = result.Quality() >= options_.good_quality || HasWideConsensus(result);
  const Rotation3 previous_rotation = motion_.last().rotation;
  if (out->state == TrackingState::kRelocalized) {
    doubtful_frames_ = options_.agreeing_frames;
    required_inlier_ratio_ = RequiredInlierRatio(frame, result.camera_from_map);
    frames_since_recovery_ = frames_tolerant_ = 0;
    leader_frames_ = 0;
    motion_.Reset(frame.time, result.camera_from_map);
    selector_.Reset();
    rotation_center_.Reset();
  } else {
    motion_.Update(frame.time, result.camera_from_map);
    if (result.observed == ObservedMotion::kHybrid) out->state = TrackingState::kHybrid;
    if (result.observed == ObservedMotion::kPanorama) out->state = TrackingState::kPanorama;
  }
  // What was found again is not extended before it has held (ptamm §6.3) and explains most of what is in
  // view: the furniture of a room fits another one, too.
  const bool doubtful = doubtful_frames_ > 0;
  if (doubtful && out->state != TrackingState::kRelocalized) {
    if (!good) doubtful_frames_ = options_.agreeing_frames;
    if (result.VisibleInlierRatio() >= required_inlier_ratio_) --doubtful_frames_;
  }
  turn_rate_ = (result.camera_from_map.rotation * previous_rotation.inverse()).Log();
  tracking_ = true;
  observed_ = result.observed;
  inliers_ = result.inliers;
  visible_inlier_ratio_ = result.VisibleInlierRatio();
  constexpr double kKept = 0.9;  // of the average in each frame
  if (!doubtful && result.inliers > 0)
    mean_visible_inlier_ratio_ = kKept * mean_visible_inlier_ratio_ + (1 - kKept) * visible_inlier_ratio_;
  out->verdict = {};
  finite_coverage_ = result.finite_coverage;
  if (result.finite_inliers > 0 && result.median_depth > 0) median_depth_ = result.median_depth;
  if (options_.hybrid && result.observed != ObservedMotion::kPanorama) {
    rotation_center_.Add(frame.time, result.camera_from_map_without_prior, result.covariance, median_depth_);
    turn_ = rotation_center_.Estimate(median_depth_);
  }
  out->map = map_;
  out->map_key = map_key_;
  out->camera_from_map = result.camera_from_map;
  out->covariance = result.covariance;
  out->quality = result.Quality();
  out->quality_class = good ? TrackingQuality::kGood : TrackingQuality::kBad;
  out->finite_points = result.finite_inliers;
  out->infinite_points = result.inliers - result.finite_inliers;
  const bool by_points = result.inliers > 0;
  if (by_points) {
    anchor_ = features_;
    anchor_pose_ = result.camera_from_map;
    last_points_ = frame.time;
    out->matches = map_tracker_.matches();
    map_tracker_.Remember();
    if (!doubtful) CollectReports();
  }
  if (!good) out->hint = "few points are found: slow down";
  if ((good || !by_points) && !doubtful && options_.build_maps) ChooseKeyFrame(frame, result, *out);
}

FrameInspection Tracker::Inspect(const TrackedFrame& tracked) const {
  FrameInspection inspection;
  // What was searched in vain after a loss may belong to maps that are gone.
  if (HasPose(tracked.state)) {
    inspection = map_tracker_.Inspect(tracked.camera_from_map);
  } else if (searched_) {
    inspection = map_tracker_.Inspect(motion_.last());
  }
  inspection.features = features_;
  return inspection;
}

}  // namespace docent::engine

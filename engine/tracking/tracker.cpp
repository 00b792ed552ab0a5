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

// A pose with a small inlier ratio is accepted only if its residuals are small. Measured with images that
// differ from the map's: right poses have a sigma of 0.8 to 1.1; of the poses with an inlier ratio below 0.2
// and a sigma of 1.0 or more, some were off by a third of a metre.
bool FitsWell(const MapTrackResult& result) {
  constexpr double kSmallRatio = 0.2;
  constexpr double kMaxSigma = 1.5, kMaxSigmaAtSmallRatio = 0.8;
  return result.sigma <= (result.Quality() >= kSmallRatio ? kMaxSigma : kMaxSigmaAtSmallRatio);
}

// Any frame time can be subtracted without overflow.
constexpr Timestamp kDistantPast = -std::chrono::hours(24 * 365 * 50);

}  // namespace

Tracker::Tracker(const TrackerOptions& options, std::shared_ptr<const CameraModel> camera, std::uint64_t seed)
    : options_(options),
      camera_(std::move(camera)),
      random_(seed),
      map_tracker_(options.map_tracker, camera_),
      competing_tracker_(options.map_tracker, camera_),
      initializer_(options.initializer, camera_, random_.Next()),
      keyframe_policy_(options.keyframe_policy, FieldOfView(*camera_)),
      rotation_center_(options.rotation_center) {
  if (options.target) target_initializer_.emplace(options.target, options.target_start, camera_, seed);
}

void Tracker::SetCamera(std::shared_ptr<const CameraModel> camera) {
  if (camera == camera_) return;
  camera_ = std::move(camera);
  map_tracker_.SetCamera(camera_);
  competing_tracker_.SetCamera(camera_);
  initializer_.SetCamera(camera_);
  if (options_.target)
    target_initializer_.emplace(options_.target, options_.target_start, camera_, random_.Next());
  keyframe_policy_.SetFieldOfView(FieldOfView(*camera_));
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
  rotation_reference_.reset();
  rotation_center_.Reset();
  pivot_estimate_ = {};
  hypothesis_key_ = leader_key_ = 0;
  hypothesis_frames_ = leader_frames_ = unconfirmed_frames_ = 0;
  ResetStart();
  map_tracker_.Clear();
  map_tracker_.EnablePanorama(kNoId);
  keyframe_policy_.Reset();
  reports_.clear();
  candidate_.reset();
  pair_.reset();
  keyframe_rotation_rates_.clear();
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
  if (same && map_ && map) ApplyCorrections(*map);
  map_ = map && !map->keyframes.empty() ? std::move(map) : nullptr;
  map_key_ = map_ ? map_key : 0;
  if (!map_) {
    tracking_ = false;
    return;
  }
  if (starting_ && !map_->HasFinitePoints()) {
    // The mapper made a panorama map of this tracker's first image.
    if (same && tracking_) return;
    const KeyFrame& first = map_->keyframes.front();
    map_tracker_.Clear();
    motion_.Reset(first.time, first.camera_from_map);
    // The keypoint tracks of the initializer must start in a frame with a known pose.
    first_view_from_map_ = first.camera_from_map;
    if (FirstViewTime() != first.time) ResetStart();
    keyframe_policy_.Offered(KeyFrameChoice::kFirst, first.time);
    observed_ = ObservedMotion::kPanorama;
    tracking_ = true;
    lost_since_ = kDistantPast;
  } else if (pair_given_) {
    // The mapper made a map of this tracker's pair: its newest keyframe is the latest known pose.
    starting_ = pair_given_ = false;
    map_tracker_.Clear();
    map_tracker_.EnablePanorama(kNoId);
    keyframe_policy_.Reset();
    motion_.Reset(map_->keyframes.back().time, map_->keyframes.back().camera_from_map);
    observed_ = ObservedMotion::kSixDof;
    tracking_ = true;
  } else if (!same) {
    map_tracker_.EnablePanorama(kNoId);
    keyframe_policy_.Reset();
    rotation_center_.Reset();
    pivot_estimate_ = {};
    map_tracker_.Clear();
    reports_.clear();
    rotation_reference_.reset();
    mean_visible_inlier_ratio_ = 1;
    tracking_ = false;
    lost_since_ = kDistantPast;
  }
}

std::shared_ptr<ImageFeatures> Tracker::NextFeatures(const Frame& frame) {
  std::shared_ptr<ImageFeatures> features;
  for (const auto& pooled : pool_) {
    // Keyframes hold theirs; features without another owner are reused.
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
  const bool low_requirement =
      result.observed == ObservedMotion::kPanorama || result.Quality() >= options_.high_quality;
  const int min_inliers = low_requirement ? options_.min_inliers_at_high_quality : options_.min_inliers;
  // Photometric tolerance matches by chance more often, and while maps are only viewed, content must not
  // jump.
  const bool strict = comparison_ == PatchComparison::kTolerant || !options_.build_maps;
  const bool fits = !strict || result.Quality() >= options_.good_quality || FitsWell(result);
  return fits && result.converged && result.sigma <= options_.max_sigma && result.inliers >= min_inliers &&
         result.occupied_cells >= options_.min_cells &&
         (result.Quality() >= options_.lost_quality || HasWideConsensus(result));
}

// Whether the inliers alone show that the pose is right, whatever the ratio of points found.
bool Tracker::HasWideConsensus(const MapTrackResult& result) const {
  return result.inliers >= options_.min_consensus_inliers && result.sigma <= options_.max_consensus_sigma &&
         result.inliers >= options_.min_consensus_ratio * result.found;
}

// Keeps the track with few points that fit closely, for cameras whose images show little of the map because
// of their field of view or photometric differences. Only while maps are not extended, and only continuing a
// recent pose: no place is recognized by such a pose.
bool Tracker::HoldsTrack(const MapTrackResult& result) const {
  if (options_.build_maps || !result.converged || result.observed != ObservedMotion::kSixDof) return false;
  if (result.occupied_cells < options_.min_recovery_cells || result.Quality() < options_.lost_quality)
    return false;
  if (result.inliers >= options_.min_inliers) return FitsWell(result);
  return result.inliers >= options_.min_tight_inliers && result.sigma <= options_.max_tight_sigma;
}

// Whether a pose that is a pure rotation fits the measurements; true for all other poses.
bool Tracker::FitsRotation(const MapTrackResult& result, const MapSnapshot& map) const {
  return result.observed != ObservedMotion::kPanorama || !map.HasFinitePoints() ||
         result.sigma <= options_.max_rotation_sigma;
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

// Runs the initializer; a panorama map may be tracked at the same time.
void Tracker::SearchInitialPair(const Frame& frame, TrackedFrame* out) {
  if (!map_) out->state = TrackingState::kInitializing;
  if (pair_given_) {
    if (!map_) out->hint = "Starting the map. Please wait.";
    return;
  }
  const bool posed = HasPose(out->state);
  if (map_ && !posed) {
    // Without a pose the initializer's first view would have no position in the map.
    ResetStart();
    return;
  }
  const bool directions = options_.hybrid && options_.build_maps;
  if (!map_ && directions) ResetStart();  // the map's first image is also the initializer's first view
  pair_ = TrackStart(frame, &out->hint);
  if (pair_) pair_->a_from_map = first_view_from_map_;
  if (!pair_ && posed && directions && !target_initializer_) pair_ = TryPanoramaViews(frame, *out);
  if (pair_) pair_given_ = true;
  if (FirstViewTime() == frame.time) first_view_from_map_ = posed ? out->camera_from_map : Rigid3();
  if (!map_ && directions) OfferKeyFrame(KeyFrameChoice::kFirst, frame, Rigid3(), {});
}

// The panorama map to search: the open one, or one to whose centre the camera has returned if the finite
// points do not cover the image.
PanoramaId Tracker::PanoramaFor(const Rigid3& predicted) const {
  if (map_->panoramas.empty()) return kNoId;
  if (keyframe_policy_.mode() == KeyFramePolicy::Mode::kPanorama) return keyframe_policy_.OpenPanorama(*map_);
  const bool needed =
      observed_ == ObservedMotion::kPanorama || finite_coverage_ < options_.keyframe_policy.min_coverage;
  return needed ? keyframe_policy_.PanoramaNear(predicted, median_depth_, *map_) : kNoId;
}

void Tracker::SetComparison(PatchComparison comparison) {
  comparison_ = comparison;
  map_tracker_.SetComparison(comparison);
  competing_tracker_.SetComparison(comparison);
}

MapTrackResult Tracker::TrackFromPrediction(const Rigid3& predicted) {
  const auto track = [&] {
    return map_tracker_.Track(*map_, *features_, predicted, MapTracker::Effort::kStandard, &random_);
  };
  if (comparison_ == PatchComparison::kStandard) {
    const MapTrackResult result = track();
    // The photometric difference may have returned.
    if (frames_tolerant_ == 0 || result.Quality() >= options_.good_quality) return result;
    SetComparison(PatchComparison::kTolerant);
    return track();
  }
  // Less and less often, as an attempt costs as much as the frame itself.
  constexpr unsigned kMaxInterval = 32;
  ++frames_tolerant_;
  if (std::has_single_bit(frames_tolerant_) || frames_tolerant_ % kMaxInterval == 0) {
    SetComparison(PatchComparison::kStandard);
    const MapTrackResult result = track();
    if (IsAccepted(result) && result.inliers >= options_.min_standard_ratio * inliers_) return result;
    SetComparison(PatchComparison::kTolerant);
  }
  return track();
}

void Tracker::EnterLostState(const Frame& frame, TrackedFrame* out) {
  map_tracker_.ForgetLastFrame();
  tracking_ = false;
  poor_rotation_frames_ = 0;
  lost_since_ = frame.time;
  frames_lost_ = 0;
  motion_.Miss(frame.time);
  out->state = TrackingState::kLost;
  out->hint = "Look back at a place you have seen before.";
}

void Tracker::TrackMap(const Frame& frame, const PlaceFinder* places, TrackedFrame* out) {
  // A commanded rotation is more accurate than the motion model.
  Rigid3 predicted = frame.commanded_rotation ? motion_.PredictWithRotation(*frame.commanded_rotation)
                                              : motion_.Predict(frame.time);
  if (observed_ == ObservedMotion::kPanorama)
    predicted = RotatedAbout(pivot_estimate_.pivot, motion_.last(), predicted.rotation);
  map_tracker_.EnablePanorama(PanoramaFor(predicted));
  map_tracker_.SetPivot(pivot_estimate_);
  MapTrackResult result = TrackFromPrediction(predicted);
  if (!IsAccepted(result)) {
    // A second attempt with larger radii, from the last pose rotated by the alignment of the thumbnails.
    const auto rotation = RotationFromPrevious();
    const Rigid3 rotated = rotation ? motion_.PredictWithRotation(*rotation) : predicted;
    result = map_tracker_.Track(*map_, *features_, rotated, MapTracker::Effort::kWide, &random_);
  }
  if (!IsAccepted(result) && !HoldsTrack(result)) {
    map_tracker_.ForgetLastFrame();
    if (options_.hybrid && TrackRotationDirectly(frame, result, out)) return;
    EnterLostState(frame, out);
    // The same image may be recognized, so that unexpected motion does not cost a frame.
    Recover(frame, places, out);
    return;
  }
  poor_rotation_frames_ = FitsRotation(result, *map_) ? 0 : poor_rotation_frames_ + 1;
  if (poor_rotation_frames_ >= options_.max_poor_rotation_frames) {
    EnterLostState(frame, out);
    out->hint = "You have left the mapped area: look back.";
    return;
  }
  out->state = TrackingState::kSixDof;
  Accept(frame, result, out);
}

// With low texture there are edges and shading but hardly a keypoint; all pixels together still determine the
// rotation (ptamm §3.2). Only if few points are expected or most of them are found: if many points fail, the
// pose is wrong.
bool Tracker::TrackRotationDirectly(const Frame& frame, const MapTrackResult& tried, TrackedFrame* out) {
  // A map without finite points represents rotations only.
  const bool low_texture = tried.attempted <= options_.low_texture_points ||
                           tried.Quality() >= options_.high_quality || !map_->HasFinitePoints();
  if (!rotation_reference_ || !low_texture ||
      frame.time - last_points_ > FromSeconds(options_.max_direct_rotation_s))
    return false;
  const SmallBlurryImage& image = features_->small_blurry;
  const double spread = cv::norm(image.pixels, cv::NORM_L2SQR) / static_cast<double>(image.pixels.total());
  const Rotation3 predicted = motion_.Predict(frame.time).rotation;
  std::optional<RotationAlignment> rotation;
  const auto align = [&] {
    rotation = AlignRotation(rotation_reference_->small_blurry, *camera_, image, *camera_,
                             predicted * rotation_reference_pose_.rotation.inverse(), 10,
                             pivot_estimate_.pivot / median_depth_);
    return rotation && rotation->converged && rotation->overlap >= options_.min_image_overlap &&
           rotation->rms * rotation->rms <= (1 - options_.min_explained_variance) * spread;
  };
  // An old reference image accumulates less error; a new one overlaps more with the present image.
  if (!align()) {
    if (!previous_ || rotation_reference_ == previous_) return false;
    rotation_reference_ = previous_;
    rotation_reference_pose_ = motion_.last();
    if (!align()) return false;
  }
  MapTrackResult result;
  result.camera_from_map = RotatedAbout(pivot_estimate_.pivot, rotation_reference_pose_,
                                        rotation->b_from_a * rotation_reference_pose_.rotation);
  result.observed = ObservedMotion::kPanorama;
  result.attempted = tried.attempted;
  Accept(frame, result, out);
  out->hint = "Too little detail here: point the camera at the exhibit.";
  return true;
}

void Tracker::Accept(const Frame& frame, const MapTrackResult& result, TrackedFrame* out) {
  const bool good = result.Quality() >= options_.good_quality || HasWideConsensus(result);
  const Rotation3 previous_rotation = motion_.last().rotation;
  if (out->state == TrackingState::kRelocalized) {
    unconfirmed_frames_ = options_.confirming_frames;
    required_inlier_ratio_ = RequiredInlierRatio(frame, result.camera_from_map);
    frames_since_recovery_ = frames_tolerant_ = 0;
    leader_frames_ = 0;
    motion_.Reset(frame.time, result.camera_from_map);
    keyframe_policy_.Reset();
    rotation_center_.Reset();
  } else {
    motion_.Update(frame.time, result.camera_from_map);
    if (result.observed == ObservedMotion::kHybrid) out->state = TrackingState::kHybrid;
    if (result.observed == ObservedMotion::kPanorama) out->state = TrackingState::kPanorama;
  }
  // After a relocalization the map is not extended until enough frames confirm the pose (ptamm §6.3) and
  // explain most of what is in view: the furniture of one room may fit another one too.
  const bool unconfirmed = unconfirmed_frames_ > 0;
  if (unconfirmed && out->state != TrackingState::kRelocalized) {
    if (!good) unconfirmed_frames_ = options_.confirming_frames;
    if (result.VisibleInlierRatio() >= required_inlier_ratio_) --unconfirmed_frames_;
  }
  rotation_rate_ = (result.camera_from_map.rotation * previous_rotation.inverse()).Log();
  tracking_ = true;
  observed_ = result.observed;
  inliers_ = result.inliers;
  visible_inlier_ratio_ = result.VisibleInlierRatio();
  constexpr double kDecay = 0.9;  // weight of the previous average
  if (!unconfirmed && result.inliers > 0)
    mean_visible_inlier_ratio_ = kDecay * mean_visible_inlier_ratio_ + (1 - kDecay) * visible_inlier_ratio_;
  out->relocalization = {};
  finite_coverage_ = result.finite_coverage;
  if (result.finite_inliers > 0 && result.median_depth > 0) median_depth_ = result.median_depth;
  if (options_.hybrid && result.observed != ObservedMotion::kPanorama) {
    rotation_center_.Add(frame.time, result.camera_from_map_without_prior, result.covariance, median_depth_);
    pivot_estimate_ = rotation_center_.Estimate(median_depth_);
  }
  out->map = map_;
  out->map_key = map_key_;
  out->camera_from_map = result.camera_from_map;
  out->covariance = result.covariance;
  out->quality = result.Quality();
  out->quality_class = good ? TrackingQuality::kGood : TrackingQuality::kBad;
  out->finite_points = result.finite_inliers;
  out->infinite_points = result.inliers - result.finite_inliers;
  const bool from_points = result.inliers > 0;
  if (from_points) {
    rotation_reference_ = features_;
    rotation_reference_pose_ = result.camera_from_map;
    last_points_ = frame.time;
    out->matches = map_tracker_.matches();
    map_tracker_.RecordMisses();
    if (!unconfirmed) CollectReports();
  }
  if (!good) out->hint = "Move more slowly.";
  if ((good || !from_points) && !unconfirmed && options_.build_maps) ChooseKeyFrame(frame, result, *out);
}

FrameInspection Tracker::Inspect(const TrackedFrame& tracked) const {
  FrameInspection inspection;
  // After a failed relocalization the searched map may no longer exist.
  if (HasPose(tracked.state)) {
    inspection = map_tracker_.Inspect(tracked.camera_from_map);
  } else if (searched_) {
    inspection = map_tracker_.Inspect(motion_.last());
  }
  inspection.features = features_;
  return inspection;
}

}  // namespace docent::engine

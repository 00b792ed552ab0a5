// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/tracker.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace docent::engine {

namespace {

double FieldOfView(const CameraModel& camera) {
  const double middle = camera.height_px() / 2.0;
  const auto left = camera.Unproject({0, middle});
  const auto right = camera.Unproject({camera.width_px() - 1.0, middle});
  return left && right ? std::acos(std::clamp(left->dot(*right), -1.0, 1.0)) : 1.0;
}

Rigid3 WithCenter(const Rotation3& rotation, const Eigen::Vector3d& center) {
  return Rigid3(rotation, -(rotation * center));
}

}  // namespace

Tracker::Tracker(const TrackerOptions& options, std::shared_ptr<const CameraModel> camera, std::uint64_t seed)
    : options_(options),
      camera_(std::move(camera)),
      random_(seed),
      map_tracker_(options.map_tracker, camera_),
      initializer_(options.initializer, camera_, random_.Next()),
      selector_(options.selector, FieldOfView(*camera_)) {}

void Tracker::Reset() {
  map_.reset();
  map_key_ = 0;
  starting_ = pair_given_ = tracking_ = false;
  entering_key_ = 0;
  entering_frames_ = 0;
  initializer_.Reset();
  map_tracker_.Clear();
  map_tracker_.EnablePanorama(kNoId);
  selector_.Reset();
  reports_.clear();
  candidate_.reset();
  pair_.reset();
}

void Tracker::StartFailed() {
  pair_given_ = false;
}

void Tracker::StartNewMap() {
  Reset();
  starting_ = true;
}

void Tracker::SetMap(std::shared_ptr<const MapSnapshot> map, std::uint64_t map_key) {
  const bool same = map_key == map_key_;
  map_ = map && !map->keyframes.empty() ? std::move(map) : nullptr;
  map_key_ = map_ ? map_key : 0;
  if (!map_) {
    tracking_ = false;
    return;
  }
  if (starting_ && !map_->HasFinitePoints()) {
    // Our own first picture became a map of directions.
    if (same && tracking_) return;
    const KeyFrame& first = map_->keyframes.front();
    map_tracker_.Clear();
    motion_.Reset(first.time, first.camera_from_map);
    // The corners that are followed must begin where the pose is known.
    first_view_from_map_ = first.camera_from_map;
    if (initializer_.first_time() != first.time) initializer_.Reset();
    selector_.Offered(KeyFrameChoice::kFirst, first.time);
    observed_ = ObservedMotion::kPanorama;
    tracking_ = true;
    lost_since_ = Timestamp::min();
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
    map_tracker_.Clear();
    reports_.clear();
    tracking_ = false;
    lost_since_ = Timestamp::min();
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
  if (frame.picture.channels() == 1) {
    gray = frame.picture;
  } else {
    gray = features->levels[0];
    cv::cvtColor(frame.picture, gray, cv::COLOR_BGR2GRAY);
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

bool Tracker::Believable(const MapTrackResult& result) const {
  const bool sure = result.observed == ObservedMotion::kPanorama || result.Quality() >= options_.sure_quality;
  const int min_inliers = sure ? options_.min_sure_inliers : options_.min_inliers;
  return result.converged && result.sigma <= options_.max_sigma && result.inliers >= min_inliers &&
         result.occupied_cells >= options_.min_cells && result.Quality() >= options_.lost_quality;
}

bool Tracker::Recovered(const MapTrackResult& result) const {
  return result.converged && result.sigma <= options_.max_sigma &&
         result.inliers >= options_.min_recovery_inliers &&
         result.occupied_cells >= options_.min_recovery_cells &&
         result.Quality() >= options_.min_recovery_quality;
}

TrackedFrame Tracker::Track(const Frame& frame, const PlaceFinder* places) {
  const auto start = std::chrono::steady_clock::now();
  TrackedFrame out;
  out.frame = frame;
  candidate_.reset();
  pair_.reset();
  previous_ = std::exchange(features_, nullptr);
  features_ = NextFeatures(frame);
  ++frames_since_keyframe_;

  if (starting_ && !map_) {
    LookForStart(frame, &out);
  } else if (tracking_) {
    TrackMap(frame, &out);
  } else {
    Recover(frame, places, &out);
  }
  if (starting_ && map_) LookForStart(frame, &out);
  out.tracking_time = std::chrono::steady_clock::now() - start;
  return out;
}

// Follows corners for two views that start a map; beside it a map of directions may already be tracked.
void Tracker::LookForStart(const Frame& frame, TrackedFrame* out) {
  if (!map_) out->state = TrackingState::kInitializing;
  if (pair_given_) {
    if (!map_) out->hint = "hold on, making a map";
    return;
  }
  const bool posed = HasPose(out->state);
  if (map_ && !posed) {
    // The first view's pose would be lost with the track.
    initializer_.Reset();
    return;
  }
  const bool directions = options_.hybrid && options_.build_maps;
  if (!map_ && directions) initializer_.Reset();  // its first view is to be the map's, too
  pair_ = initializer_.Track(frame.time, features_);
  if (pair_) {
    pair_->a_from_map = first_view_from_map_;
    pair_given_ = true;
  }
  if (initializer_.first_time() == frame.time) first_view_from_map_ = posed ? out->camera_from_map : Rigid3();
  out->hint = initializer_.hint();
  if (!map_ && directions) OfferKeyFrame(KeyFrameChoice::kFirst, frame, Rigid3(), {});
}

// The panorama map whose points are looked for: the one that is open, or one whose centre the camera is back
// in when the map of finite points does not fill the picture.
PanoramaId Tracker::PanoramaFor(const Rigid3& predicted) const {
  if (map_->panoramas.empty()) return kNoId;
  if (selector_.mode() == KeyFrameSelector::Mode::kPanorama) return selector_.OpenPanorama(*map_);
  const bool needed =
      observed_ == ObservedMotion::kPanorama || finite_coverage_ < options_.selector.min_coverage;
  return needed ? selector_.PanoramaNear(predicted, median_depth_, *map_) : kNoId;
}

void Tracker::TrackMap(const Frame& frame, TrackedFrame* out) {
  // What was commanded is known better than what was observed before.
  Rigid3 predicted = frame.turned ? motion_.PredictWithRotation(*frame.turned) : motion_.Predict(frame.time);
  if (observed_ == ObservedMotion::kPanorama)
    predicted = WithCenter(predicted.rotation, motion_.last().OriginInSource());
  map_tracker_.EnablePanorama(PanoramaFor(predicted));
  MapTrackResult result =
      map_tracker_.Track(*map_, *features_, predicted, MapTracker::Effort::kUsual, &random_);
  if (!Believable(result)) {
    // A second try, wider and turned as the whole picture turned.
    const auto rotation = RotationFromPrevious();
    const Rigid3 turned = rotation ? motion_.PredictWithRotation(*rotation) : predicted;
    result = map_tracker_.Track(*map_, *features_, turned, MapTracker::Effort::kWide, &random_);
  }
  if (!Believable(result)) {
    map_tracker_.Forget();
    tracking_ = false;
    lost_since_ = frame.time;
    motion_.Miss(frame.time);
    out->state = TrackingState::kLost;
    out->hint = "look back at what was mapped";
    return;
  }
  out->state = TrackingState::kSixDof;
  Accept(frame, result, out);
}

void Tracker::Accept(const Frame& frame, const MapTrackResult& result, TrackedFrame* out) {
  const bool good = result.Quality() >= options_.good_quality;
  if (out->state == TrackingState::kRelocalized) {
    motion_.Reset(frame.time, result.camera_from_map);
    selector_.Reset();
  } else {
    motion_.Update(frame.time, result.camera_from_map);
    if (result.observed == ObservedMotion::kHybrid) out->state = TrackingState::kHybrid;
    if (result.observed == ObservedMotion::kPanorama) out->state = TrackingState::kPanorama;
  }
  tracking_ = true;
  observed_ = result.observed;
  finite_coverage_ = result.finite_coverage;
  if (result.finite_inliers > 0 && result.median_depth > 0) median_depth_ = result.median_depth;
  out->map = map_;
  out->map_key = map_key_;
  out->camera_from_map = result.camera_from_map;
  out->covariance = result.covariance;
  out->quality = result.Quality();
  out->quality_class = good ? TrackingQuality::kGood : TrackingQuality::kBad;
  out->finite_points = result.finite_inliers;
  out->infinite_points = result.inliers - result.finite_inliers;
  out->matches = map_tracker_.matches();
  if (!good) out->hint = "few points are found: slow down";
  CollectReports();
  if (good && options_.build_maps) ChooseKeyFrame(frame, result, *out);
}

void Tracker::ChooseKeyFrame(const Frame& frame, const MapTrackResult& result, const TrackedFrame& out) {
  const bool wants_six_dof = result.observed != ObservedMotion::kPanorama &&
                             WantsKeyFrame(options_.keyframes, *map_, result.camera_from_map, result);
  KeyFrameChoice choice = wants_six_dof ? KeyFrameChoice::kSixDof : KeyFrameChoice::kNone;
  if (options_.hybrid) {
    // What carries the camera is what grows.
    if (selector_.mode() == KeyFrameSelector::Mode::kSixDof && result.observed == ObservedMotion::kPanorama) {
      if (const PanoramaMap* panorama = map_->FindPanorama(map_tracker_.panorama()))
        selector_.Reopen(*panorama, *map_);
    }
    choice = selector_.Select({.time = frame.time,
                               .camera_from_map = result.camera_from_map,
                               .observed = result.observed,
                               .finite_coverage = result.finite_coverage,
                               .coverage = result.coverage,
                               .points = result.inliers,
                               .median_depth = median_depth_,
                               .wants_six_dof = wants_six_dof},
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
  candidate.camera = camera_;
  candidate.features = features_;
  candidate.camera_from_map = camera_from_map;
  for (const PointMatch& match : matches) {
    if (match.inlier) candidate.matches.push_back(match);
  }
  candidate_ = std::move(candidate);
  selector_.Offered(choice, frame.time);
}

void Tracker::CollectReports() {
  if (!options_.build_maps) return;
  for (const MapTracker::Attempt& attempt : map_tracker_.attempts()) {
    PointReport& report = reports_[attempt.point];
    report.point = attempt.point;
    if (attempt.inlier) {
      ++report.inlier;
    } else if (attempt.found) {
      ++report.outlier;
    } else {
      ++report.not_found;
    }
  }
}

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

std::vector<Tracker::TurnedPlace> Tracker::BestPlaces(const PlaceFinder& places) const {
  std::vector<TurnedPlace> turned;
  for (const PlaceCandidate& candidate : places.FindPlaces(
           features_->small_blurry, options_.candidates_looked_at, options_.candidates_of_a_map, 0)) {
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

void Tracker::Recover(const Frame& frame, const PlaceFinder* places, TrackedFrame* out) {
  out->state = map_ || !options_.build_maps ? TrackingState::kLost : TrackingState::kInitializing;
  out->hint = "look back at what was mapped";
  if (map_ && RecoverNearby(frame, out)) return;
  if (!places) return;
  MapTrackResult result;
  // A map that is about to be entered is followed, not searched anew.
  if (entering_frames_ > 0) {
    const auto found = places->FindPlaces(features_->small_blurry, 1, 1, entering_key_);
    if (!found.empty()) {
      const auto rotation = RotationFromPrevious();
      const Rigid3 turn(rotation ? *rotation : Rotation3(), Eigen::Vector3d::Zero());
      map_tracker_.Clear();
      map_tracker_.EnablePanorama(entering_panorama_);
      result = map_tracker_.Track(*found.front().map, *features_, turn * entering_pose_,
                                  MapTracker::Effort::kWide, &random_);
      if (Recovered(result)) {
        entering_pose_ = result.camera_from_map;
        if (++entering_frames_ < options_.agreeing_frames) return;
        map_ = found.front().map;
        map_key_ = entering_key_;
        entering_frames_ = 0;
        reports_.clear();
        out->state = TrackingState::kRelocalized;
        out->hint.clear();
        Accept(frame, result, out);
        return;
      }
    }
    entering_frames_ = 0;
  }
  for (const TurnedPlace& place : BestPlaces(*places)) {
    const PlaceCandidate& candidate = place.candidate;
    map_tracker_.Clear();
    const KeyFrame* keyframe = candidate.map->FindKeyFrame(candidate.keyframe);
    map_tracker_.EnablePanorama(keyframe ? keyframe->panorama : kNoId);
    result = map_tracker_.Track(*candidate.map, *features_, place.camera_from_map,
                                MapTracker::Effort::kRecovery, &random_);
    if (!Recovered(result)) continue;
    if (candidate.map_key == map_key_) {
      out->state = TrackingState::kRelocalized;
      out->hint.clear();
      Accept(frame, result, out);
    } else {
      entering_key_ = candidate.map_key;
      entering_panorama_ = map_tracker_.panorama();
      entering_pose_ = result.camera_from_map;
      entering_frames_ = 1;
    }
    return;
  }
  map_tracker_.Clear();
}

std::optional<KeyFrameCandidate> Tracker::TakeKeyFrameCandidate() {
  if (candidate_) frames_since_keyframe_ = 0;
  return std::exchange(candidate_, std::nullopt);
}

std::optional<InitialPair> Tracker::TakeInitialPair() {
  return std::exchange(pair_, std::nullopt);
}

std::vector<PointReport> Tracker::TakeReports() {
  std::vector<PointReport> reports;
  reports.reserve(reports_.size());
  for (const auto& [id, report] : reports_) reports.push_back(report);
  reports_.clear();
  return reports;
}

}  // namespace docent::engine

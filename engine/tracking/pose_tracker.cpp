// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/pose_tracker.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <opencv2/core.hpp>
#include <utility>

#include "engine/map/map_readout.h"
#include "engine/tracking/reference_keyframe.h"
#include "engine/vision/rotation_alignment.h"

namespace docent::engine {

PoseTracker::PoseTracker(const TrackerOptions& options, std::shared_ptr<const CameraModel> camera)
    : options_(options),
      criteria_(options),
      lens_(camera),
      image_camera_(camera),
      map_tracker_(options.map_tracker, std::move(camera)),
      rotation_center_(options.rotation_center),
      readout_(options.readout) {
  SetCamera(lens_);
}

void PoseTracker::Reset() {
  SetCamera(lens_);
  rotation_reference_.reset();
  rotation_center_.Reset();
  pivot_estimate_ = {};
  readout_map_ = nullptr;
  largest_rate_in_map_ = 0;
  map_tracker_.Clear();
  map_tracker_.EnablePanorama(kNoId);
}

void PoseTracker::Begin(Timestamp time, const Rigid3& camera_from_map, ObservedMotion observed) {
  map_tracker_.Clear();
  map_tracker_.EnablePanorama(kNoId);
  readout_map_ = nullptr;
  largest_rate_in_map_ = 0;
  motion_.Reset(time, camera_from_map);
  position_.Reset();
  observed_ = observed;
}

void PoseTracker::BeginWithDepth(Timestamp time, const Rigid3& camera_from_map, bool tracked) {
  const Timestamp newest = motion_.time();
  if (!tracked || newest <= time) return Begin(time, camera_from_map, ObservedMotion::kSixDof);
  const Rotation3 rotation = motion_.last().rotation;
  const Eigen::Vector3d rate_per_second = motion_.twist_per_second().tail<3>();
  const Eigen::Vector3d center = camera_from_map.OriginInSource();
  Begin(newest, Rigid3(rotation, -(rotation * center)), ObservedMotion::kSixDof);
  motion_.SetRotating(time, rate_per_second);
}

void PoseTracker::ContinueFrom(const PoseTracker& other) {
  map_tracker_.ForgetLastFrame();
  map_tracker_.EnablePanorama(kNoId);
  readout_map_ = nullptr;
  SetComparison(other.comparison_);
  frames_tolerant_ = other.frames_tolerant_;
  motion_ = other.motion_;
  position_ = other.position_;
  rotation_center_.Reset();
  pivot_estimate_ = other.pivot_estimate_;
  observed_ = other.observed_;
  inliers_ = other.inliers_;
  finite_coverage_ = other.finite_coverage_;
  median_depth_ = other.median_depth_;
  rotation_rate_ = other.rotation_rate_;
  poor_rotation_frames_ = 0;
  rotation_reference_ = other.rotation_reference_;
  rotation_reference_pose_ = other.rotation_reference_pose_;
  readout_s_ = other.readout_s_;
  largest_rate_in_map_ = other.largest_rate_in_map_;
  readout_ = other.readout_;
  last_points_ = other.last_points_;
  drift_per_s_ = other.drift_per_s_;
}

void PoseTracker::ApplyCorrections(const MapSnapshot& before, const MapSnapshot& newer, bool tracked) {
  if (newer.corrections.empty() || newer.corrections.back()->revision <= before.revision) return;
  const KeyFrameId reference_keyframe = FindReferenceKeyFrame(
      before, tracked ? std::span(map_tracker_.matches()) : std::span<const PointMatch>());
  for (const auto& correction : newer.corrections) {
    if (correction->revision <= before.revision || correction->revision > newer.revision) continue;
    const auto moved = correction->after_from_before.find(reference_keyframe);
    if (moved == correction->after_from_before.end()) continue;
    motion_.ApplyCorrection(moved->second);
    position_.ApplyCorrection(moved->second);
    rotation_reference_pose_ = CorrectedPose(rotation_reference_pose_, moved->second);
    median_depth_ *= moved->second.scale;
    pivot_estimate_.pivot *= moved->second.scale;
    rotation_center_.Reset();
  }
}

PanoramaId PoseTracker::PanoramaFor(const Rigid3& predicted, const MapSnapshot& map,
                                    const KeyFramePolicy& policy) const {
  if (map.panoramas.empty()) return kNoId;
  if (policy.mode() == KeyFramePolicy::Mode::kPanorama) return policy.OpenPanorama(map);
  const bool needed =
      observed_ == ObservedMotion::kPanorama || finite_coverage_ < options_.keyframe_policy.min_coverage;
  return needed ? policy.PanoramaNear(predicted, median_depth_, map) : kNoId;
}

void PoseTracker::SearchPanoramaAt(const Rigid3& camera_from_map, const MapSnapshot& map,
                                   const KeyFramePolicy& policy) {
  map_tracker_.EnablePanorama(PanoramaFor(camera_from_map, map, policy));
}

void PoseTracker::SetComparison(PatchComparison comparison) {
  comparison_ = comparison;
  map_tracker_.SetComparison(comparison);
}

void PoseTracker::AlternateComparison() {
  SetComparison(comparison_ == PatchComparison::kStandard ? PatchComparison::kTolerant
                                                          : PatchComparison::kStandard);
}

MapTrackResult PoseTracker::TryFrom(const MapSnapshot& map, const CameraImage& image, const Rigid3& guess,
                                    MapTracker::Effort effort, Random* random) {
  return map_tracker_.Track(map, *image.features, guess, effort, random);
}

MapTrackResult PoseTracker::TryElsewhere(const MapSnapshot& map, const CameraImage& image,
                                         const Rigid3& guess, PanoramaId panorama, MapTracker::Effort effort,
                                         Random* random) {
  map_tracker_.Clear();
  map_tracker_.SetPredictedCenter(std::nullopt);
  map_tracker_.EnablePanorama(panorama);
  return TryFrom(map, image, guess, effort, random);
}

Rigid3 PoseTracker::PredictAfterLoss(const CameraImage& image) const {
  const auto rotation = image.RotationFromPrevious();
  return rotation ? motion_.PredictWithRotation(image.time, *rotation) : motion_.Predict(image.time);
}

void PoseTracker::ContinueFrom(Timestamp time, const Rigid3& camera_from_map) {
  map_tracker_.ForgetLastFrame();
  map_tracker_.SetPredictedCenter(std::nullopt);
  motion_.Reset(time, camera_from_map);
}

void PoseTracker::Follow(const PoseTracker& other, Timestamp time) {
  ContinueFrom(time, other.last());
  position_ = other.position_;
}

void PoseTracker::ExpectPosition(Timestamp time) {
  // While a map is built its points are corrected, and a camera that is followed too stiffly loses them: a
  // hand-held one in an office that stops within 0.15 s was lost, and a map was discarded in 14 of 20 runs
  // instead of 3.
  if (options_.build_maps) return;
  map_tracker_.SetPredictedCenter(position_.Predict(time, median_depth_));
}

MapTrackResult PoseTracker::TryFromPrediction(const MapSnapshot& map, const CameraImage& image,
                                              const Rigid3& predicted, MapTracker::Effort effort,
                                              Random* random) {
  if (options_.readout.enabled) SetTwist(motion_.twist_per_second());
  if (!HasReadoutMotion(image)) return TryFrom(map, image, predicted, effort, random);
  return map_tracker_.Track(map, *image.features, predicted, effort, random,
                            [&](const Rigid3& camera_from_map) {
                              SetReadoutMotion(image, camera_from_map);
                              return image_camera_;
                            });
}

MapTrackResult PoseTracker::TrackFromPrediction(const MapSnapshot& map, const CameraImage& image,
                                                const Rigid3& predicted, Random* random) {
  const auto track = [&] {
    return TryFromPrediction(map, image, predicted, MapTracker::Effort::kStandard, random);
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
    if (criteria_.IsAccepted(result, comparison_) && result.inliers >= options_.min_standard_ratio * inliers_)
      return result;
    SetComparison(PatchComparison::kTolerant);
  }
  return track();
}

void PoseTracker::UpdateReadout(const MapSnapshot& map) {
  if (readout_map_ == &map && readout_revision_ == map.revision) return;
  readout_map_ = &map;
  readout_revision_ = map.revision;
  const auto& known_s = lens_->known_readout_s();
  const auto in_map_s = known_s ? known_s : ReadoutIn(map, *lens_);
  readout_is_known_ = known_s || (in_map_s && !in_map_s->isZero(0));
  if (readout_is_known_) readout_s_ = *in_map_s;
  const double largest_rate = in_map_s && !readout_is_known_ ? LargestRotationRateIn(map, *lens_) : 0;
  if (largest_rate > largest_rate_in_map_) {
    // The mapper has found none with images that turn faster than those before.
    readout_s_.setZero();
    readout_ = ReadoutEstimator(options_.readout);
  }
  largest_rate_in_map_ = largest_rate;
}

bool PoseTracker::MayEstimateReadout() const {
  // What an unknown readout time has bent in the map is at most a third of what it does to this image.
  constexpr double kFasterThanMap = 3;
  // While this camera's calibration is not known, the errors of its map look like a readout time.
  const bool may_use_map = largest_rate_in_map_ == 0 || options_.initializer.estimate_readout;
  return !readout_is_known_ && may_use_map &&
         image_camera_->readout_motion().rotation_rate.norm() > kFasterThanMap * largest_rate_in_map_;
}

void PoseTracker::SetTwist(const Eigen::Matrix<double, 6, 1>& twist) {
  Eigen::Vector3d rate = twist.tail<3>();
  // A translation displaces the image about as a rotation does that moves points at the median depth alike.
  if (observed_ != ObservedMotion::kPanorama && median_depth_ > 0)
    rate += Eigen::Vector3d(-twist[1], twist[0], 0) / median_depth_;
  const std::shared_ptr<CameraModel> camera = image_cameras_.Take();
  *camera = CameraModel::WithReadout(lens_, {rate, readout_s_});
  image_camera_ = camera;
  map_tracker_.SetCamera(image_camera_);
}

bool PoseTracker::HasReadoutMotion(const CameraImage& image) const {
  return options_.readout.enabled && !image.is_repeated && motion_.SecondsUntil(image.time) > 0;
}

void PoseTracker::SetReadoutMotion(const CameraImage& image, const Rigid3& camera_from_map) {
  // The mean twist since the last image is that of half an interval ago. It is not extrapolated: where the
  // points lie above or below the middle of the image, the pose depends on the twist, and the poses swung
  // from image to image. In 1000 images of a Kinect with a readout time of 29 ms, the rotation between two of
  // them was wrong by 4.7 milliradians in the median, and by 3.3 with the mean.
  SetTwist(motion_.MeanTwist(image.time, camera_from_map));
}

void PoseTracker::EstimateReadout(const CameraImage& image, const MapTrackResult& result) {
  if (!HasReadoutMotion(image)) return;
  SetReadoutMotion(image, result.camera_from_map);
  if (!MayEstimateReadout()) return;
  readout_.Add(*image_camera_, result.camera_from_map, map_tracker_.measurements(), result.sigma,
               motion_.SecondsUntil(image.time));
  if (!readout_.readout_s().isZero(0)) readout_s_ = readout_.readout_s();
}

PoseTracker::Estimate PoseTracker::Track(const MapSnapshot& map, const CameraImage& image,
                                         const std::optional<Rotation3>& commanded,
                                         const KeyFramePolicy& policy, Random* random) {
  using Outcome = Estimate::Outcome;
  // A commanded rotation is more accurate than the motion model.
  Rigid3 predicted = commanded ? motion_.PredictWithRotation(*commanded) : motion_.Predict(image.time);
  if (image.is_repeated) predicted = motion_.last();
  if (observed_ == ObservedMotion::kPanorama)
    predicted = RotatedAbout(pivot_estimate_.pivot, motion_.last(), predicted.rotation);
  if (options_.readout.enabled) UpdateReadout(map);
  SearchPanoramaAt(predicted, map, policy);
  map_tracker_.SetPivot(pivot_estimate_);
  ExpectPosition(image.is_repeated ? motion_.time() : image.time);
  MapTrackResult result = TrackFromPrediction(map, image, predicted, random);
  if (!criteria_.IsAccepted(result, comparison_)) {
    map_tracker_.SetPredictedCenter(std::nullopt);
    // A second attempt with larger radii, from the last pose rotated by the alignment of the thumbnails.
    const auto rotation = image.RotationFromPrevious();
    if (rotation) {
      predicted = motion_.PredictWithRotation(*rotation);
      if (observed_ == ObservedMotion::kPanorama)
        predicted = RotatedAbout(pivot_estimate_.pivot, motion_.last(), predicted.rotation);
    }
    result = TryFromPrediction(map, image, predicted, MapTracker::Effort::kWide, random);
  }
  if (!criteria_.IsAccepted(result, comparison_) && !criteria_.KeepsTrackWithFewPoints(result)) {
    map_tracker_.ForgetLastFrame();
    SetCamera(lens_);
    if (!options_.hybrid) return {Outcome::kLost, result};
    const auto rotation_only = TrackRotationDirectly(map, image, result);
    return rotation_only ? Estimate{Outcome::kRotationOnly, *rotation_only}
                         : Estimate{Outcome::kLost, result};
  }
  EstimateReadout(image, result);
  map_tracker_.SetPredictedCenter(std::nullopt);
  poor_rotation_frames_ = criteria_.FitsRotation(result, map) ? 0 : poor_rotation_frames_ + 1;
  const bool left = poor_rotation_frames_ >= options_.max_poor_rotation_frames;
  return {left ? Outcome::kLeftMap : Outcome::kPose, result};
}

// A camera that walks away from its map sees few of its points too, and its position changes.
double PoseTracker::LongestDirectRotation_s(const MapSnapshot& map) const {
  constexpr double kMostDrift = 0.2;  // Of the median depth: content is off by 11 degrees then.
  if (!map.HasFinitePoints()) return options_.max_direct_rotation_s;
  return kMostDrift / std::max(drift_per_s_.norm(), kMostDrift / options_.max_direct_rotation_s);
}

// With low texture there are edges and shading but hardly a keypoint; all pixels together still determine the
// rotation (ptamm §3.2). Only if few points are expected or most of them are found: if many points fail, the
// pose is wrong.
std::optional<MapTrackResult> PoseTracker::TrackRotationDirectly(const MapSnapshot& map,
                                                                 const CameraImage& image,
                                                                 const MapTrackResult& tried) {
  // A map without finite points represents rotations only.
  const bool low_texture = tried.attempted <= options_.low_texture_points ||
                           tried.Quality() >= options_.high_quality || !map.HasFinitePoints();
  if (!rotation_reference_ || !low_texture ||
      image.time - last_points_ > FromSeconds(LongestDirectRotation_s(map)))
    return std::nullopt;
  const SmallBlurryImage& thumbnail = image.features->small_blurry;
  const double spread =
      cv::norm(thumbnail.pixels, cv::NORM_L2SQR) / static_cast<double>(thumbnail.pixels.total());
  const Rotation3 predicted = motion_.Predict(image.time).rotation;
  std::optional<RotationAlignment> rotation;
  const auto align = [&] {
    rotation = AlignRotation(rotation_reference_->small_blurry, *image.camera, thumbnail, *image.camera,
                             predicted * rotation_reference_pose_.rotation.inverse(), 10,
                             pivot_estimate_.pivot / median_depth_);
    return rotation && rotation->converged && rotation->overlap >= options_.min_image_overlap &&
           rotation->rms * rotation->rms <= (1 - options_.min_explained_variance) * spread;
  };
  // An old reference image accumulates less error; a new one overlaps more with the present image.
  if (!align()) {
    if (!image.previous || rotation_reference_ == image.previous) return std::nullopt;
    rotation_reference_ = image.previous;
    rotation_reference_pose_ = motion_.last();
    if (!align()) return std::nullopt;
  }
  MapTrackResult result;
  result.camera_from_map = RotatedAbout(pivot_estimate_.pivot, rotation_reference_pose_,
                                        rotation->b_from_a * rotation_reference_pose_.rotation);
  result.observed = ObservedMotion::kPanorama;
  result.attempted = tried.attempted;
  return result;
}

void PoseTracker::UpdateDrift(double seconds) {
  constexpr double kTimeConstant_s =
      0.2;  // The noise of single poses is 0.002 of the depth; see RotationCenter.
  const Eigen::Matrix<double, 6, 1>& twist = motion_.twist_per_second();
  const Eigen::Vector3d pivot =
      pivot_estimate_.reliable ? pivot_estimate_.pivot : Eigen::Vector3d::Zero().eval();
  const Eigen::Vector3d drift_per_s =
      (twist.head<3>() + twist.tail<3>().cross(pivot)) / std::max(median_depth_, 1e-9);
  drift_per_s_ += std::clamp(seconds / kTimeConstant_s, 0.0, 1.0) * (drift_per_s - drift_per_s_);
}

void PoseTracker::UpdatePosition(const CameraImage& image, const MapTrackResult& result) {
  if (image.is_repeated) return;  // It measures nothing new.
  const double sigma = options_.map_tracker.refinement.common_error_factor *
                       std::sqrt(result.covariance.topLeftCorner<3, 3>().trace());
  const bool from_points = result.observed != ObservedMotion::kPanorama && result.finite_inliers > 0;
  if (!from_points || !(sigma > 0) || !std::isfinite(sigma)) {
    position_.Reset();
    return;
  }
  position_.Add(image.time, result.camera_from_map.OriginInSource(), sigma, median_depth_,
                result.used_center);
}

void PoseTracker::Accept(const CameraImage& image, const MapTrackResult& result, bool relocalized) {
  const Rotation3 previous_rotation = motion_.last().rotation;
  const Timestamp previous_time = motion_.time();
  if (relocalized) {
    frames_tolerant_ = 0;
    drift_per_s_.setZero();
    motion_.Reset(image.time, result.camera_from_map);
    rotation_center_.Reset();
    position_.Reset();
  } else if (!image.is_repeated) {
    motion_.Update(image.time, result.camera_from_map);
  }
  if (!image.is_repeated)
    rotation_rate_ = (result.camera_from_map.rotation * previous_rotation.inverse()).Log();
  observed_ = result.observed;
  inliers_ = result.inliers;
  finite_coverage_ = result.finite_coverage;
  if (result.finite_inliers > 0 && result.median_depth > 0) median_depth_ = result.median_depth;
  UpdatePosition(image, result);
  if (options_.hybrid && result.observed != ObservedMotion::kPanorama) {
    rotation_center_.Add(image.time, result.camera_from_map_without_prior, result.covariance, median_depth_);
    pivot_estimate_ = rotation_center_.Estimate(median_depth_);
    UpdateDrift(ToSeconds(image.time - previous_time));
  }
  if (result.inliers == 0) return;
  rotation_reference_ = image.features;
  rotation_reference_pose_ = result.camera_from_map;
  last_points_ = image.time;
  map_tracker_.RecordMisses();
}

void PoseTracker::Lose(Timestamp time) {
  SetCamera(lens_);
  map_tracker_.ForgetLastFrame();
  poor_rotation_frames_ = 0;
  position_.Reset();
  map_tracker_.SetPredictedCenter(std::nullopt);
  motion_.Miss(time);
}

}  // namespace docent::engine

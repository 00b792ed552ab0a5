// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/visual_odometry.h"

#include <utility>

namespace docent::engine {

namespace {

// Odometry depends on points that were seen a moment ago, so that it needs more keyframes than a map: one as
// soon as a tenth of the points of the nearest keyframe is lost (Mur-Artal, Montiel and Tardós 2015, section
// V-E). With the map's ratio of 0.6, a camera before plain cupboards was lost with 28 points
// before the next one came.
//
// While a panorama map is open, there are no keyframes that can be triangulated, and points without depth are
// right only until the camera has moved by a few hundredths of the depth. Opened wherever few points were
// left, it lost the same cupboards for a second in six of fifteen visits; opened by any rotation, it lost a
// turning visitor behind people in nine of twelve. Without it, a turning camera was off by up to two degrees,
// which is 0.6 degrees with it.
TrackerOptions OptionsOfOdometry(TrackerOptions options) {
  options.keyframes.min_found_ratio = 0.9;
  options.keyframe_policy.opens_by_rotation_with_few_points = true;
  return options;
}

// Before a distant wall, points alone do not determine the position. While the camera turns about a known
// centre, it is that of the centre.
bool IsOfRotationCenter(const VisualOdometry::MapPose& pose, const TrackerOptions& options) {
  const MapTrackResult& result = pose.tracked.result;
  return result.observed == ObservedMotion::kPanorama && pose.rotation_center &&
         result.inliers == result.finite_inliers &&
         result.finite_inliers >= options.min_relocalization_inliers;
}

}  // namespace

VisualOdometry::VisualOdometry(const TrackerOptions& options,
                               const std::shared_ptr<const CameraModel>& camera)
    : options_(OptionsOfOdometry(options)),
      criteria_(options_),
      pose_(options_, camera),
      offers_(options_, *camera),
      relocalizer_(options_) {}

void VisualOdometry::SetCamera(const std::shared_ptr<const CameraModel>& camera) {
  pose_.SetCamera(camera);
  offers_.SetCamera(*camera);
}

void VisualOdometry::SetCopy(std::shared_ptr<const MapSnapshot> copy) {
  copy_ = std::move(copy);
  if (!copy_) active_ = false;
}

void VisualOdometry::Reset() {
  invalid_copy_ = invalid_copy_ || copy_ != nullptr;
  SetCopy(nullptr);
  pose_.Reset();
  offers_.Reset();
}

void VisualOdometry::AddMapPose(const CameraImage& image, const MapSnapshot& map, const MapPose& pose) {
  // What was added during a long odometry may be as far off as its pose.
  if (active_ && image.time - last_map_pose_ > FromSeconds(options_.short_loss_s)) Reset();
  active_ = false;
  last_map_pose_ = image.time;
  MapTrackResult result = pose.tracked.result;
  // Without keyframes of these images, a visitor who turned on behind people was lost where the map ended.
  if (IsOfRotationCenter(pose, options_)) result.observed = ObservedMotion::kSixDof;
  has_position_ = result.observed != ObservedMotion::kPanorama;
  if (!pose.good || options_.max_odometry_s <= 0 || result.finite_inliers >= options_.few_points_of_map)
    return;
  offers_.Consider(image, copy_ ? *copy_ : map,
                   {result, pose.tracked.matches, pose.tracked.panorama, pose.tracked.median_depth});
}

void VisualOdometry::Begin(const PoseTracker& lost) {
  if (active_ || !copy_ || (lost.observed() == ObservedMotion::kPanorama && !has_position_)) return;
  pose_.ContinueFrom(lost);
  lost_since_.reset();
  active_ = true;
}

std::optional<MapTrackResult> VisualOdometry::Track(const CameraImage& image,
                                                    const std::optional<Rotation3>& commanded,
                                                    Random* random) {
  if (image.time - last_map_pose_ > FromSeconds(options_.max_odometry_s) ||
      (lost_since_ && image.time - *lost_since_ > FromSeconds(options_.short_loss_s))) {
    active_ = false;
    return std::nullopt;
  }
  if (lost_since_) return Recover(image, random);
  PoseTracker::Estimate estimate = pose_.Track(*copy_, image, commanded, offers_.policy(), random);
  using Outcome = PoseTracker::Estimate::Outcome;
  if (estimate.outcome == Outcome::kLost || estimate.outcome == Outcome::kLeftMap) {
    lost_since_ = image.time;
    pose_.Lose(image.time);
    relocalizer_.Lose(image.time);
    return std::nullopt;
  }
  pose_.Accept(image, estimate.result, /*relocalized=*/false);
  if (criteria_.IsGood(estimate.result) && estimate.result.inliers > 0) {
    CameraImage moving = image;
    moving.camera = pose_.image_camera();
    const MapTracker& tracked = pose_.map_tracker();
    offers_.Consider(moving, *copy_,
                     {estimate.result, tracked.matches(), tracked.panorama(), pose_.median_depth()});
  }
  return estimate.result;
}

std::optional<MapTrackResult> VisualOdometry::Recover(const CameraImage& image, Random* random) {
  TrackedFrame unused;
  const PoseSearch search = {.image = image,
                             .map = copy_,
                             .policy = offers_.policy(),
                             .criteria = criteria_,
                             .pose = &pose_,
                             .hypothesis = &hypothesis_,
                             .random = random};
  const auto found = relocalizer_.Search(search, &unused);
  if (!found) return std::nullopt;
  lost_since_.reset();
  pose_.Accept(image, found->result, /*relocalized=*/true);
  return found->result;
}

}  // namespace docent::engine

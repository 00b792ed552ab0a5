// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/keyframe_policy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "engine/base/option_check.h"

namespace docent::engine {

namespace {

double AngleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

Eigen::Vector3d AxisOf(const Rigid3& camera_from_map) {
  return camera_from_map.rotation.inverse() * Eigen::Vector3d(Eigen::Vector3d::UnitZ());
}

}  // namespace

std::optional<std::string> KeyFramePolicyOptions::Validate() const {
  return OptionCheck()
      .Within(min_parallax_deg, 0, 180, "parallax of a keyframe")
      .Ratio(min_coverage, "coverage of the map")
      .AtLeast(min_view_ratio, 0, "angle between viewing directions")
      .Ratio(min_panorama_coverage, "coverage of a panorama map")
      .AtLeast(few_points, 0, "number of few points")
      .AtLeast(min_view_ratio_when_few, 0, "angle between viewing directions when points are few")
      .AtLeast(few_points_without_rotation, 0, "number of few points without rotation")
      .AtLeast(max_without_rotation, 0, "number of keyframes without rotation")
      .NotNegative(history, "history of poses")
      .NotNegative(open_timeout, "time to open a panorama map")
      .NotNegative(history_interval, "interval between poses of the history")
      .fault();
}

KeyFramePolicy::KeyFramePolicy(const KeyFramePolicyOptions& options, double field_of_view)
    : options_(Checked(options)), field_of_view_(field_of_view) {}

void KeyFramePolicy::Reset() {
  mode_ = Mode::kSixDof;
  reference_time_ = {};
  reference_camera_.reset();
  history_.clear();
}

// hybrid-slam §4.1: the angle between the rays from both centres to a point at this depth.
bool KeyFramePolicy::HasParallax(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double depth) const {
  const double angle = 2 * std::atan2((a - b).norm(), 2 * depth);
  return angle > options_.min_parallax_deg * std::numbers::pi / 180;
}

// hybrid-slam §4.2: an earlier pose in the history had the same centre and another viewing direction.
bool KeyFramePolicy::IsPureRotation(const Pose& now, double depth) const {
  return std::any_of(history_.begin(), history_.end(), [&](const Pose& before) {
    return !HasParallax(before.center, now.center, depth) &&
           AngleBetween(before.axis, now.axis) > options_.min_view_ratio * field_of_view_;
  });
}

void KeyFramePolicy::AddToHistory(const Pose& pose) {
  while (!history_.empty() && pose.time - history_.front().time > options_.history)
    history_.erase(history_.begin());
  if (history_.empty() || pose.time - history_.back().time >= options_.history_interval)
    history_.push_back(pose);
}

PanoramaId KeyFramePolicy::OpenPanorama(const MapSnapshot& map) const {
  if (mode_ != Mode::kPanorama) return kNoId;
  PanoramaId newest = kNoId;
  for (auto it = map.panoramas.rbegin(); it != map.panoramas.rend(); ++it) {
    const KeyFrame* reference = map.FindKeyFrame(it->reference);
    if (!reference || reference->time != reference_time_) continue;
    // Another camera may have opened one with an image of the same time. The calibration of the right one may
    // have been estimated anew since.
    if (reference_camera_ && reference->camera && reference->camera->HasSameLens(*reference_camera_))
      return it->id;
    if (newest == kNoId) newest = it->id;
  }
  return newest;
}

PanoramaId KeyFramePolicy::PanoramaNear(const Rigid3& camera_from_map, double depth,
                                        const MapSnapshot& map) const {
  constexpr double kNear = 0.5;  // ratio of the parallax at which a panorama map is left
  const Eigen::Vector3d center = camera_from_map.OriginInSource(), axis = AxisOf(camera_from_map);
  PanoramaId best = kNoId;
  double smallest = std::numeric_limits<double>::max();
  for (const PanoramaMap& panorama : map.panoramas) {
    const KeyFrame* reference = map.FindKeyFrame(panorama.reference);
    if (!reference || HasParallax(reference->camera_from_map.OriginInSource(), center, kNear * depth))
      continue;
    for (const KeyFrame& keyframe : map.keyframes) {
      if (keyframe.panorama != panorama.id) continue;
      const double angle = AngleBetween(AxisOf(keyframe.camera_from_map), axis);
      if (angle > 0.5 * field_of_view_ || angle >= smallest) continue;
      smallest = angle;
      best = panorama.id;
    }
  }
  return best;
}

void KeyFramePolicy::Reopen(const PanoramaMap& panorama, const MapSnapshot& map) {
  const KeyFrame* reference = map.FindKeyFrame(panorama.reference);
  if (!reference) return;
  mode_ = Mode::kPanorama;
  reference_time_ = reference->time;
  reference_camera_ = reference->camera;
}

KeyFrameChoice KeyFramePolicy::Select(const PolicyFrame& frame, const MapSnapshot& map) {
  const Pose now{frame.time, frame.camera_from_map.OriginInSource(), AxisOf(frame.camera_from_map)};
  const bool localized = frame.observed != ObservedMotion::kPanorama;
  if (mode_ == Mode::kPanorama && frame.time - reference_time_ > options_.open_timeout &&
      OpenPanorama(map) == kNoId)
    mode_ = Mode::kSixDof;
  if (mode_ == Mode::kPanorama && localized) {
    // hybrid-slam §4.5. Some finite points may stay visible during a whole rotation; they alone do not end
    // the panorama map.
    const PanoramaMap* panorama = map.FindPanorama(OpenPanorama(map));
    const KeyFrame* reference = panorama ? map.FindKeyFrame(panorama->reference) : nullptr;
    const bool away =
        reference && HasParallax(reference->camera_from_map.OriginInSource(), now.center, frame.median_depth);
    if (away || frame.finite_coverage >= options_.min_coverage) mode_ = Mode::kSixDof;
  }
  if (mode_ == Mode::kSixDof) {
    // The pose comes from infinite points of a closed panorama map.
    if (!localized) return KeyFrameChoice::kNone;
    const bool unknown = frame.finite_coverage < options_.min_coverage;
    const bool leaves_map = unknown && frame.points < options_.few_points;
    const bool pure_rotation = unknown && IsPureRotation(now, frame.median_depth);
    AddToHistory(now);
    const bool needs_both = options_.opens_by_rotation_with_few_points;
    // Whatever the motion was, infinite points are better than losing the track.
    if (leaves_map && !needs_both && PanoramaNear(frame.camera_from_map, frame.median_depth, map) == kNoId)
      return KeyFrameChoice::kLocalizedPanorama;
    if (pure_rotation && (leaves_map || !needs_both) && frame.coverage < options_.min_panorama_coverage) {
      const bool parallax = std::all_of(map.keyframes.begin(), map.keyframes.end(), [&](const KeyFrame& k) {
        return k.kind == KeyFrameKind::kPanorama ||
               HasParallax(k.camera_from_map.OriginInSource(), now.center, frame.median_depth);
      });
      if (!parallax) return KeyFrameChoice::kLocalizedPanorama;
    }
    return frame.needs_six_dof ? KeyFrameChoice::kSixDof : KeyFrameChoice::kNone;
  }
  const PanoramaId open = OpenPanorama(map);
  if (open == kNoId || frame.coverage >= options_.min_panorama_coverage) return KeyFrameChoice::kNone;
  // In a map without finite points, few inliers mean that the camera has translated near the scene. A
  // keyframe then adds what is visible now, for any viewing direction. A map with finite points would only
  // gain drift from that.
  if (frame.points < options_.few_points_without_rotation && !map.HasFinitePoints()) {
    const auto in_this_direction =
        std::count_if(map.keyframes.begin(), map.keyframes.end(), [&](const KeyFrame& k) {
          return k.panorama == open && AngleBetween(AxisOf(k.camera_from_map), now.axis) <=
                                           options_.min_view_ratio_when_few * field_of_view_;
        });
    if (in_this_direction < options_.max_without_rotation) return KeyFrameChoice::kPanorama;
  }
  const double ratio =
      frame.points < options_.few_points ? options_.min_view_ratio_when_few : options_.min_view_ratio;
  const bool is_new_direction =
      std::all_of(map.keyframes.begin(), map.keyframes.end(), [&](const KeyFrame& k) {
        return k.panorama != open ||
               AngleBetween(AxisOf(k.camera_from_map), now.axis) > ratio * field_of_view_;
      });
  return is_new_direction ? KeyFrameChoice::kPanorama : KeyFrameChoice::kNone;
}

void KeyFramePolicy::Accepted(KeyFrameChoice choice, Timestamp time,
                              std::shared_ptr<const CameraModel> camera) {
  if (choice != KeyFrameChoice::kLocalizedPanorama && choice != KeyFrameChoice::kFirst) return;
  mode_ = Mode::kPanorama;
  reference_time_ = time;
  reference_camera_ = std::move(camera);
}

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <chrono>
#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/rigid3.h"
#include "engine/initialization/hint.h"
#include "engine/map/map_snapshot.h"
#include "engine/matching/point_match.h"
#include "engine/tracking/relocalization_result.h"
#include "engine/vision/frame.h"

namespace docent::engine {

// The tracking state shown to the user. ToString returns the names of docs/output-files.md.
enum class TrackingState : std::uint8_t {
  kInitializing,
  kSixDof,
  kHybrid,
  kPanorama,
  kLost,
  kRelocalized,
  kDropped
};
const char* ToString(TrackingState state);  // a word in lower case
// True for the states in which the frame has a pose.
bool HasPose(TrackingState state);

// Class of the inlier ratio (ptamm §2.1).
enum class TrackingQuality : std::uint8_t { kGood, kPoor, kLost };

// The tracker's result for one frame. It holds image, pose and map together, so that they are always
// consistent.
struct TrackedFrame {
  Frame frame;                                             // the image that was processed
  TrackingState state = TrackingState::kInitializing;      // whether there is a pose, and of what kind
  TrackingQuality quality_class = TrackingQuality::kLost;  // class of `quality`
  double quality = 0;                      // inlier ratio: inliers over points searched (ptamm §2.1)
  std::shared_ptr<const MapSnapshot> map;  // map of the pose; null if there is none
  std::uint64_t map_key = 0;               // identifies the map within the session; 0 if there is none
  Rigid3 camera_from_map;                  // valid if HasPose(state)
  Eigen::Matrix<double, 6, 6> covariance =
      Eigen::Matrix<double, 6, 6>::Zero();     // of the left twist, camera frame
  int finite_points = 0, infinite_points = 0;  // inliers
  std::vector<PointMatch> matches;             // map points that were found in the image
  std::chrono::nanoseconds tracking_time{};    // by the system clock
  // The map itself does not determine this pose: it is continued by points of this visit (VisualOdometry), so
  // that it is less certain, and there are no matches.
  bool by_odometry = false;
  bool left_map = false;    // lost because the camera translated where only infinite points are mapped
  Hint hint = Hint::kNone;  // what a person can do so that tracking works
  // How close a map that is being initialized has come to its first finite points, 0 to 1; empty when none
  // is, and with a planar target.
  std::optional<double> initialization_progress;
  RelocalizationResult relocalization;  // of a lost frame: why no hypothesis was accepted; kNone otherwise
};

}  // namespace docent::engine

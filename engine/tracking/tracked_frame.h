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
#include "engine/map/map_snapshot.h"
#include "engine/tracking/relocalization_result.h"

namespace docent::engine {

// One image as delivered by a camera. The pixels are not modified once they are in a Frame.
struct Frame {
  Timestamp time{};
  int camera = 0;           // index in the session
  std::uint64_t index = 0;  // counts the images of this camera, including dropped ones
  cv::Mat image;            // CV_8UC3 (BGR) or CV_8UC1
  // The rotation now_from_previous that was commanded to a motorised head since the previous image; empty if
  // there was none.
  std::optional<Rotation3> commanded_rotation;
};

// The tracking state shown to the user. ToString returns the names of command-line.md.
enum class TrackingState : std::uint8_t {
  kInitializing,
  kSixDof,
  kHybrid,
  kPanorama,
  kLost,
  kRelocalized,
  kDropped
};
const char* ToString(TrackingState state);
// True for the states in which the frame has a pose.
bool HasPose(TrackingState state);

enum class TrackingQuality : std::uint8_t { kGood, kBad, kLost };

// A point that was found in the frame, for overlays and reports.
struct PointMatch {
  MapPointId point = kNoId;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // level 0
  std::uint8_t level = 0;
  bool inlier = false;
};

// The tracker's result for one frame. It holds image, pose and map together, so that they are always
// consistent.
struct TrackedFrame {
  Frame frame;
  TrackingState state = TrackingState::kInitializing;
  TrackingQuality quality_class = TrackingQuality::kLost;
  double quality = 0;                      // inlier ratio: inliers over points searched (ptamm §2.1)
  std::shared_ptr<const MapSnapshot> map;  // map of the pose; null if there is none
  std::uint64_t map_key = 0;               // identifies the map within the session; 0 if there is none
  Rigid3 camera_from_map;                  // valid if HasPose(state)
  Eigen::Matrix<double, 6, 6> covariance =
      Eigen::Matrix<double, 6, 6>::Zero();     // of the left twist, camera frame
  int finite_points = 0, infinite_points = 0;  // inliers
  std::vector<PointMatch> matches;
  std::chrono::nanoseconds tracking_time{};
  std::string hint;                     // advice to the user as one sentence, often empty
  RelocalizationResult relocalization;  // of a lost frame: why no hypothesis was accepted; kNone otherwise
};

}  // namespace docent::engine

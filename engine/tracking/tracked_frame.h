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

// One image as a camera delivered it. Images are not written to once they are in a Frame.
struct Frame {
  Timestamp time{};
  int camera = 0;           // index in the session
  std::uint64_t index = 0;  // counts the images of this camera, dropped ones too
  cv::Mat image;            // CV_8UC3 (BGR) or CV_8UC1
  // now_from_previous of a camera that was told to turn its head since its previous image; empty otherwise.
  std::optional<Rotation3> turned;
};

// What the wearer is told of each image; the names of command-line.md are in ToString.
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

// A point that was looked for in the frame, for overlays and reports.
struct PointMatch {
  MapPointId point = kNoId;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // where it was found, level 0
  std::uint8_t level = 0;
  bool inlier = false;
};

// The tracker's answer for one frame; complete in itself, so that image, pose and map always belong
// together.
struct TrackedFrame {
  Frame frame;
  TrackingState state = TrackingState::kInitializing;
  TrackingQuality quality_class = TrackingQuality::kLost;
  double quality = 0;                      // fraction of the points looked for that were found (ptamm §2.1)
  std::shared_ptr<const MapSnapshot> map;  // the map the pose is in; null when there is none
  std::uint64_t map_key = 0;               // names that map within the session; 0 when there is none
  Rigid3 camera_from_map;                  // valid when HasPose(state)
  Eigen::Matrix<double, 6, 6> covariance =
      Eigen::Matrix<double, 6, 6>::Zero();     // of the left twist, camera frame
  int finite_points = 0, infinite_points = 0;  // inliers
  std::vector<PointMatch> matches;
  std::chrono::nanoseconds tracking_time{};
  std::string hint;              // a sentence for the wearer ("move sideways"), often empty
  RelocalizationResult verdict;  // of a lost frame that resembles some place; no doubt otherwise
};

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "engine/mapping/two_view_geometry.h"
#include "engine/tracking/tracked_frame.h"

namespace docent::engine {

// What a frame is to become (hybrid-slam §4).
enum class KeyFrameChoice : std::uint8_t {
  kNone,
  kSixDof,
  kLocalizedPanorama,  // six degrees of freedom, and the reference of a new panorama map
  kPanorama,           // turned only: a dependent keyframe of the panorama map that is open
  kFirst,              // the first of an empty map, which is a panorama map until it knows depth
};

// A frame that a tracker offers to the mapper as a keyframe (ptamm §2.2), with what it saw there.
struct KeyFrameCandidate {
  KeyFrameChoice choice = KeyFrameChoice::kSixDof;
  PanoramaId panorama = kNoId;  // that a kPanorama joins
  Timestamp time{};
  std::shared_ptr<const CameraModel> camera;
  std::shared_ptr<const ImageFeatures> features;
  Rigid3 camera_from_map;
  std::vector<PointMatch> matches;  // inliers only
  // The snapshot that the pose is in, and the keyframe that most of what it shows was first seen in: should
  // the map be moved before the keyframe joins it, it goes along with that one. 0: the newest.
  std::uint64_t map_revision = 0;
  KeyFrameId reference_keyframe = kNoId;
};

// How often each point was looked for, found and believed since the last report: the trackers' verdict on it.
struct PointReport {
  MapPointId point = kNoId;
  int inlier = 0, outlier = 0, not_found = 0;
};

// Two views with matched corners and the pose between them: enough to start a map.
struct InitialPair {
  struct View {
    Timestamp time{};
    std::shared_ptr<const ImageFeatures> features;
  };
  struct Match {
    Eigen::Vector2f pixel_a, pixel_b;  // level 0
    std::uint8_t level = 0;            // that the corner was found on, in view a
  };
  std::shared_ptr<const CameraModel> camera;
  View a, b;
  std::vector<Match> matches;
  Rigid3 a_from_map;       // where the first view is, if the map exists already as a panorama; else identity
  TwoViewResult geometry;  // one inlier flag and point a match
  double baseline_m = 0;   // the true distance of the views; 0 where nothing tells it
};

}  // namespace docent::engine

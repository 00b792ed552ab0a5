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

// The kind of keyframe that a frame becomes (hybrid-slam §4).
enum class KeyFrameChoice : std::uint8_t {
  kNone,
  kSixDof,
  kLocalizedPanorama,  // a 6-DoF keyframe that is also the reference of a new panorama map
  kPanorama,           // rotation only: a dependent keyframe of the open panorama map
  kFirst,  // the first keyframe of an empty map, which is a panorama map until finite points exist
};

// A frame that a tracker offers to the mapper as a keyframe (ptamm §2.2), with the matches found in it.
struct KeyFrameCandidate {
  KeyFrameChoice choice = KeyFrameChoice::kSixDof;
  PanoramaId panorama = kNoId;  // the panorama map that a kPanorama keyframe joins
  Timestamp time{};
  std::shared_ptr<const CameraModel> camera;
  std::shared_ptr<const ImageFeatures> features;
  Rigid3 camera_from_map;
  std::vector<PointMatch> matches;  // inliers only
  // Revision of the snapshot that the pose refers to, and the keyframe that shares most points with the
  // frame. If the map is corrected before the mapper inserts the candidate, its pose moves with that
  // keyframe. Revision 0: the newest.
  std::uint64_t map_revision = 0;
  KeyFrameId reference_keyframe = kNoId;
};

// Counts of how the trackers' searches for one point ended since the last report.
struct PointReport {
  MapPointId point = kNoId;
  int inlier = 0, outlier = 0, not_found = 0;
};

// Two views with matched corners and the relative pose between them: sufficient to initialize a map.
struct InitialPair {
  struct View {
    Timestamp time{};
    std::shared_ptr<const ImageFeatures> features;
  };
  struct Match {
    Eigen::Vector2f pixel_a, pixel_b;  // level 0
    std::uint8_t level = 0;            // pyramid level of the corner in view a
  };
  std::shared_ptr<const CameraModel> camera;
  View a, b;
  std::vector<Match> matches;
  Rigid3 a_from_map;       // pose of the first view if the map already exists as a panorama; else identity
  TwoViewResult geometry;  // one inlier flag and one point per match
  double baseline_m = 0;   // distance of the views in metres; 0 if unknown
};

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "engine/initialization/initial_pair.h"
#include "engine/matching/point_match.h"

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

}  // namespace docent::engine

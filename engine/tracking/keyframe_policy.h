// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/rigid3.h"
#include "engine/map/map_snapshot.h"
#include "engine/mapping/keyframe_candidate.h"
#include "engine/tracking/pose_refinement.h"

namespace docent::engine {

struct KeyFramePolicyOptions {
  double min_parallax_deg = 5.0;       // hybrid-slam §4.1: a smaller angle does not triangulate well
  double min_coverage = 0.75;          // hybrid-slam §4.1: less of the image is known than this
  double min_view_ratio = 0.2;         // hybrid-slam §4.2: of the field of view, between viewing directions
  double min_panorama_coverage = 0.8;  // hybrid-slam §4.4
  // With fewer points than this a panorama map is about to run out: a keyframe is due after less of a turn.
  int few_points = 60;
  double min_view_ratio_when_few = 0.03;
  // With fewer than these, half of `few_points`, a map of directions alone gets a keyframe without any turn.
  int fewest_points = 30;
  Timestamp history = std::chrono::seconds(10);  // poses that tell a turn from a walk
  // A mapper that has not opened the panorama map by then has not taken its reference.
  Timestamp patience = std::chrono::seconds(1);
  Timestamp history_interval = std::chrono::milliseconds(60);  // between them
};

// What a tracked frame tells the selector.
struct PolicyFrame {
  Timestamp time{};
  Rigid3 camera_from_map;
  ObservedMotion observed = ObservedMotion::kSixDof;
  double finite_coverage = 1, coverage = 1;  // shares of the image, see MapTrackResult
  int points = 0;                            // of either kind that agree with the pose
  double median_depth = 1;                   // metres, of the finite points
  bool wants_six_dof = false;  // new enough a view for a keyframe of general motion (ptamm §2.2)
};

// The state machine of hybrid-slam Fig. 3: when a camera turns on the spot towards what the map does not
// know, keyframes go to a local panorama map instead of being lost for want of parallax. It sees poses and
// coverage alone, no image. One a tracker, on its thread.
//
//   kSixDof    general motion; a turn on the spot that leaves the known part opens a panorama map (§4.2)
//   kPanorama  a panorama map is open; left when the map is well seen again or the camera has moved away
//   (§4.5)
class KeyFramePolicy {
 public:
  enum class Mode : std::uint8_t { kSixDof, kPanorama };

  // field_of_view: radians, of the wider side of the image.
  KeyFramePolicy(const KeyFramePolicyOptions& options, double field_of_view);

  // Another map, or a pose that does not follow from the one before: back to general motion.
  void Reset();
  // Answers what the frame should become. The caller may let a wish pass; it comes again.
  KeyFrameChoice Select(const PolicyFrame& frame, const MapSnapshot& map);
  // The caller has offered what Select chose, as a keyframe of this time.
  void Offered(KeyFrameChoice choice, Timestamp time);

  Mode mode() const { return mode_; }
  // The panorama map that is open in this snapshot; kNoId while none is, or the mapper has not made it yet.
  PanoramaId OpenPanorama(const MapSnapshot& map) const;
  // A closed panorama map that the camera is back in the centre of, looking its way; kNoId for none.
  PanoramaId PanoramaNear(const Rigid3& camera_from_map, double depth, const MapSnapshot& map) const;
  // An existing panorama map is extended from now on.
  void Reopen(const PanoramaMap& panorama, const MapSnapshot& map);

 private:
  struct Pose {
    Timestamp time;
    Eigen::Vector3d center, axis;  // of the camera, in the map
  };
  bool Parallax(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double depth) const;
  bool IsPureRotation(const Pose& now, double depth) const;
  void Remember(const Pose& pose);

  const KeyFramePolicyOptions options_;
  const double field_of_view_;
  Mode mode_ = Mode::kSixDof;
  Timestamp reference_time_{};  // of the open panorama map's reference keyframe
  std::vector<Pose> history_;   // allocates nothing once it is full
};

}  // namespace docent::engine

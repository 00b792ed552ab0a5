// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/rigid3.h"
#include "engine/map/map_snapshot.h"
#include "engine/mapping/keyframe_candidate.h"
#include "engine/matching/pose_refinement.h"

namespace docent::engine {

struct KeyFramePolicyOptions {
  // With a smaller parallax the camera has not translated. A distance of 0.04 of the depth, from which on a
  // keyframe of general motion adds points (KeyFrameNoveltyOptions::min_distance_when_few). With the 5
  // degrees of hybrid-slam §4.1, a camera that rotates while it walks opened one panorama map after the
  // other, which delayed the keyframes that give depth to what comes into view.
  double min_parallax_deg = 2.3;
  // A frame whose finite inliers cover less of the image than this leaves the map (hybrid-slam §4.1).
  double min_coverage = 0.75;
  // Smallest angle between viewing directions, as a ratio of the field of view (hybrid-slam §4.2).
  double min_view_ratio = 0.2;
  double min_panorama_coverage = 0.8;  // hybrid-slam §4.4
  // With fewer inliers than this the camera is about to leave the panorama map, and a smaller rotation
  // suffices for a panorama keyframe.
  int few_points = 60;
  double min_view_ratio_when_few = 0.03;
  // If true, a panorama map is opened only by a pure rotation with few points, not by either of them.
  bool opens_by_rotation_with_few_points = false;
  // With fewer inliers than this (half of few_points), a map without finite points gets a keyframe without
  // any rotation.
  int few_points_without_rotation = 30;
  // But only up to this many keyframes in the same direction, those of five seconds. Leaves, water or a
  // screen never stop changing, and each keyframe needs about 0.4 MB.
  int max_without_rotation = 30;
  // Poses of this period are compared to tell pure rotation from translation.
  Timestamp history = std::chrono::seconds(10);
  // A panorama map that the mapper has not opened within this time after it accepted the keyframe is given
  // up: the keyframe had too few corners, or its map was replaced meanwhile.
  Timestamp open_timeout = std::chrono::seconds(1);
  Timestamp history_interval = std::chrono::milliseconds(60);  // Interval between the poses of the history.

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// The facts about a tracked frame that the policy decides by.
struct PolicyFrame {
  Timestamp time{};
  Rigid3 camera_from_map;
  ObservedMotion observed = ObservedMotion::kSixDof;
  double finite_coverage = 1, coverage = 1;  // ratios of the image, see MapTrackResult
  int points = 0;                            // inliers, finite and infinite
  double median_depth = 1;                   // map units, of the finite inliers
  bool needs_six_dof = false;  // new enough a view for a keyframe of general motion (ptamm §2.2)
};

// Decides which frames become keyframes, by the state machine of hybrid-slam Fig. 3. When a camera rotates
// without translation towards an unmapped area, its frames cannot be triangulated, so they go to a local
// panorama map. The policy uses poses and coverage only, no image. Each tracker owns one and uses it on its
// thread.
//
//  kSixDof    General motion. A pure rotation that leaves the mapped area opens a panorama map (§4.2).
//  kPanorama  A panorama map is open. It is left when finite points cover the image again or when the
//             camera has translated (§4.5).
class KeyFramePolicy {
 public:
  enum class Mode : std::uint8_t { kSixDof, kPanorama };

  // field_of_view: horizontal angle of view in radians.
  KeyFramePolicy(const KeyFramePolicyOptions& options, double field_of_view);

  // Sets a new field of view, as in the constructor, after the camera model was estimated anew.
  void SetFieldOfView(double field_of_view) { field_of_view_ = field_of_view; }
  // Returns to kSixDof. To be called after a change of the map and after a pose that does not continue the
  // previous one.
  void Reset();
  // Returns what kind of keyframe this frame should become. The caller may ignore it; a later frame is chosen
  // again.
  KeyFrameChoice Select(const PolicyFrame& frame, const MapSnapshot& map);
  // To be called when the mapper has accepted the frame of this time as a keyframe of this kind. camera: that
  // took it, which tells it from a keyframe of the same time of another camera; may be null.
  void Accepted(KeyFrameChoice choice, Timestamp time, std::shared_ptr<const CameraModel> camera = nullptr);

  Mode mode() const { return mode_; }
  // The open panorama map in this snapshot; kNoId if none is open or the mapper has not created it yet.
  PanoramaId OpenPanorama(const MapSnapshot& map) const;
  // A closed panorama map to whose centre the camera has returned, with a keyframe of a similar viewing
  // direction; kNoId if there is none. depth: median depth, map units.
  PanoramaId PanoramaNear(const Rigid3& camera_from_map, double depth, const MapSnapshot& map) const;
  // Extends an existing panorama map from now on.
  void Reopen(const PanoramaMap& panorama, const MapSnapshot& map);

 private:
  struct Pose {
    Timestamp time;
    Eigen::Vector3d center, axis;  // camera centre and viewing direction in the map
  };
  bool HasParallax(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double depth) const;
  bool IsPureRotation(const Pose& now, double depth) const;
  void AddToHistory(const Pose& pose);

  const KeyFramePolicyOptions options_;
  double field_of_view_;
  Mode mode_ = Mode::kSixDof;
  Timestamp reference_time_{};                           // time of the open panorama map's reference keyframe
  std::shared_ptr<const CameraModel> reference_camera_;  // its camera; may be null
  std::vector<Pose> history_;                            // does not allocate once it is full
};

}  // namespace docent::engine

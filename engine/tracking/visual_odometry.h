// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "engine/base/random.h"
#include "engine/tracking/keyframe_offers.h"
#include "engine/tracking/pose_tracker.h"
#include "engine/tracking/relocalizer.h"

namespace docent::engine {

// Continues the pose of a camera that has left what its map shows, while maps are only viewed. The mapper
// extends a copy of the map with keyframes of this visit, which nobody saves; the points of that copy carry
// the pose on until the map itself is seen again. Errors accumulate with time and distance, as in any visual
// odometry, so that it ends after TrackerOptions::max_odometry_s. Poses are camera_from_map. Used on the
// camera's thread.
class VisualOdometry {
 public:
  VisualOdometry(const TrackerOptions& options, const std::shared_ptr<const CameraModel>& camera);

  void SetRim(const RimMask* rim) { pose_.SetRim(rim); }
  void SetCamera(const std::shared_ptr<const CameraModel>& camera);
  // The newest state of the extended copy; null while there is none.
  void SetCopy(std::shared_ptr<const MapSnapshot> copy);
  // The camera was relocalized, or is in another map: the pose ends, and the copy is no longer valid.
  void Reset();
  // To be called before each frame.
  void BeginFrame() { offers_.BeginFrame(); }

  // A pose that points of the map determine.
  struct MapPose {
    KeyFrameOffers::TrackedPose tracked;
    bool good = false;             // its quality
    bool rotation_center = false;  // see PoseTracker::has_rotation_center
  };
  // Such a pose ends the odometry. Where the points are few, and the quality is good, the image is offered as
  // a keyframe of the copy.
  void AddMapPose(const CameraImage& image, const MapSnapshot& map, const MapPose& pose);
  // The map no longer determines the pose of the present image: the odometry goes on from the last one, if
  // there is a copy and the position is known: from points, or as that of a rotation centre.
  void Begin(const PoseTracker& lost);
  bool is_active() const { return active_; }
  bool has_pose() const { return active_ && !lost_since_; }  // of the last image
  // The pose of the next image; empty if the points are lost or the time is over, which ends the odometry.
  // Needs is_active().
  std::optional<MapTrackResult> Track(const CameraImage& image, const std::optional<Rotation3>& commanded,
                                      Random* random);
  // The track in the copy.
  const PoseTracker& pose() const { return pose_; }
  // True once after the copy became invalid.
  bool TakeInvalidCopy() { return std::exchange(invalid_copy_, false); }

  // The keyframes for the copy, as those of a map that is extended.
  KeyFrameOffers& offers() { return offers_; }

 private:
  // Searches the copy near the last pose.
  std::optional<MapTrackResult> Recover(const CameraImage& image, Random* random);

  TrackerOptions options_;
  PoseCriteria criteria_;
  PoseTracker pose_;
  KeyFrameOffers offers_;
  Relocalizer relocalizer_;
  MapHypothesis hypothesis_;  // not used: only the copy is searched
  std::shared_ptr<const MapSnapshot> copy_;
  bool active_ = false, invalid_copy_ = false;
  std::optional<Timestamp> lost_since_;  // while the points of the copy are not found
  Timestamp last_map_pose_{};            // time of the last pose that came from the map
  bool has_position_ = false;            // whether that pose included the position
};

}  // namespace docent::engine

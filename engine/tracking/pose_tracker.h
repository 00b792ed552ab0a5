// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/base/random.h"
#include "engine/base/shared_pool.h"
#include "engine/tracking/camera_image.h"
#include "engine/tracking/keyframe_policy.h"
#include "engine/tracking/map_tracker.h"
#include "engine/tracking/motion_model.h"
#include "engine/tracking/pose_criteria.h"
#include "engine/tracking/position_filter.h"
#include "engine/tracking/readout_estimator.h"
#include "engine/tracking/rotation_center.h"
#include "engine/tracking/tracker_options.h"

namespace docent::engine {

// Follows the pose of one camera from frame to frame: predicts it, has a MapTracker estimate it, judges it,
// and continues a rotation from all pixels where there are too few points. Knows nothing of other maps or
// places. Poses are camera_from_map. Used on the camera's thread.
class PoseTracker {
 public:
  PoseTracker(const TrackerOptions& options, std::shared_ptr<const CameraModel> camera);

  void SetRim(const RimMask* rim) { map_tracker_.SetRim(rim); }
  void SetCamera(const std::shared_ptr<const CameraModel>& camera) {
    lens_ = image_camera_ = camera;
    map_tracker_.SetCamera(camera);
    if (camera->known_readout_s()) readout_s_ = *camera->known_readout_s();
  }
  // Forgets the map and the motion in it.
  void Reset();
  // A map was started, and this is the newest pose known in it.
  void Begin(Timestamp time, const Rigid3& camera_from_map, ObservedMotion observed);
  // The panorama map that was tracked until now, if tracked, got its first finite points from two views, of
  // which the second has this time and pose. A rotation that was tracked since then is kept.
  void BeginWithDepth(Timestamp time, const Rigid3& camera_from_map, bool tracked);
  // Goes on from the last pose of another tracker in a copy of its map.
  void ContinueFrom(const PoseTracker& other);
  // Transforms everything in map coordinates by the corrections between two snapshots. tracked: the last
  // frame had a pose.
  void ApplyCorrections(const MapSnapshot& before, const MapSnapshot& newer, bool tracked);

  struct Estimate {
    enum class Outcome {
      kPose,
      kRotationOnly,  // from all pixels; `result` holds no points
      kLost,
      kLeftMap,  // the camera has translated where only infinite points are mapped
    };
    Outcome outcome = Outcome::kLost;
    MapTrackResult result;
  };
  // Estimates the pose of the next frame of the track. commanded: the rotation since the previous frame,
  // where it is known. The caller answers with Accept or Lose.
  Estimate Track(const MapSnapshot& map, const CameraImage& image, const std::optional<Rotation3>& commanded,
                 const KeyFramePolicy& policy, Random* random);
  // The pose of the present frame. relocalized: it does not continue the previous ones.
  void Accept(const CameraImage& image, const MapTrackResult& result, bool relocalized);
  // The present frame has no pose.
  void Lose(Timestamp time);

  // For relocalization.
  // The last pose, moved on by the rotation of the images or else by the motion model.
  Rigid3 PredictAfterLoss(const CameraImage& image) const;
  // Predicts the next frame from this pose, although no pose was found there in this one.
  void ContinueFrom(Timestamp time, const Rigid3& camera_from_map);
  // This tracker of the same camera has the pose of the present frame.
  void Follow(const PoseTracker& other, Timestamp time);
  // The attempts that follow use the predicted position where the points determine it poorly.
  void ExpectPosition(Timestamp time);
  // Searches the points of the panorama map that this pose needs.
  void SearchPanoramaAt(const Rigid3& camera_from_map, const MapSnapshot& map, const KeyFramePolicy& policy);
  MapTrackResult TryFrom(const MapSnapshot& map, const CameraImage& image, const Rigid3& guess,
                         MapTracker::Effort effort, Random* random);
  // The same at a place that was not tracked in the last frame.
  MapTrackResult TryElsewhere(const MapSnapshot& map, const CameraImage& image, const Rigid3& guess,
                              PanoramaId panorama, MapTracker::Effort effort, Random* random);
  void ForgetPatches() { map_tracker_.Clear(); }
  // With the standard comparison next time if it was tolerant, and the other way round.
  void AlternateComparison();

  PatchComparison comparison() const { return comparison_; }
  const MapTracker& map_tracker() const { return map_tracker_; }
  // The camera with the motion of the image that was tracked last.
  const std::shared_ptr<const CameraModel>& image_camera() const { return image_camera_; }
  // The readout time of the camera, seconds; see ReadoutMotion.
  const Eigen::Vector2d& readout_s() const { return readout_s_; }
  const Rigid3& last() const { return motion_.last(); }
  ObservedMotion observed() const { return observed_; }  // what the last pose determined
  // Rotation vector per frame, of the last tracked frame.
  const Eigen::Vector3d& rotation_rate() const { return rotation_rate_; }
  double median_depth() const { return median_depth_; }
  // Where the points determine only the rotation, the position is known too: that of a reliable rotation
  // centre.
  bool has_rotation_center() const { return pivot_estimate_.reliable; }

 private:
  // Gives the present image the rolling shutter of a camera that moves with this left twist per second.
  void SetTwist(const Eigen::Matrix<double, 6, 1>& twist);
  // Takes the readout time from a snapshot that has not been read yet, unless the calibration states it.
  void UpdateReadout(const MapSnapshot& map);
  // Whether the readout time may be estimated from the residuals of the present image: no map has it yet,
  // nor a calibration, and the images of the map were not taken while turning as fast.
  bool MayEstimateReadout() const;
  // Whether the motion during an image is to be taken from its pose.
  bool HasReadoutMotion(const CameraImage& image) const;
  // Gives an image with this pose the motion that the pose implies.
  void SetReadoutMotion(const CameraImage& image, const Rigid3& camera_from_map);
  // Tracks the map from the predicted pose, with the motion during the image that the new pose implies.
  MapTrackResult TryFromPrediction(const MapSnapshot& map, const CameraImage& image, const Rigid3& predicted,
                                   MapTracker::Effort effort, Random* random);
  // Gives an image the motion of its accepted pose, and estimates the readout time from the residuals, unless
  // it is known.
  void EstimateReadout(const CameraImage& image, const MapTrackResult& result);
  // The panorama map to search: the open one, or one to whose centre the camera has returned if the finite
  // points do not cover the image.
  PanoramaId PanoramaFor(const Rigid3& predicted, const MapSnapshot& map, const KeyFramePolicy& policy) const;
  // Tracks the map from the predicted pose. With photometric tolerance, tries the standard comparison from
  // time to time and keeps it if it succeeds.
  MapTrackResult TrackFromPrediction(const MapSnapshot& map, const CameraImage& image,
                                     const Rigid3& predicted, Random* random);
  // How long the rotation may be tracked without points until the position is no longer known.
  double LongestDirectRotation_s(const MapSnapshot& map) const;
  std::optional<MapTrackResult> TrackRotationDirectly(const MapSnapshot& map, const CameraImage& image,
                                                      const MapTrackResult& tried);
  void SetComparison(PatchComparison comparison);
  // After a pose from finite points, this long after the one before.
  void UpdateDrift(double seconds);
  void UpdatePosition(const CameraImage& image, const MapTrackResult& result);

  TrackerOptions options_;
  PoseCriteria criteria_;
  std::shared_ptr<const CameraModel> lens_, image_camera_;
  SharedPool<CameraModel> image_cameras_;
  MapTracker map_tracker_;
  MotionModel motion_;
  PositionFilter position_;
  RotationCenter rotation_center_;
  PivotEstimate pivot_estimate_;  // pivot of the present rotation
  // What the last pose determined. After kPanorama the camera centre is kept.
  ObservedMotion observed_ = ObservedMotion::kSixDof;
  PatchComparison comparison_ = PatchComparison::kStandard;
  unsigned frames_tolerant_ = 0;                   // consecutive frames tracked with photometric tolerance
  int inliers_ = 0;                                // of the last frame
  double finite_coverage_ = 1, median_depth_ = 1;  // of the last frame with finite inliers
  Eigen::Vector3d rotation_rate_ = Eigen::Vector3d::Zero();
  int poor_rotation_frames_ = 0;  // consecutive frames whose residual no rotation explains
  // Reference image of TrackRotationDirectly: the newest image whose pose came from map points or, in a long
  // rotation, a later one.
  std::shared_ptr<const ImageFeatures> rotation_reference_;
  Rigid3 rotation_reference_pose_;
  // The readout time of the calibration takes precedence, then that of a map that this camera builds;
  // elsewhere, and until that map has one, it is estimated here.
  Eigen::Vector2d readout_s_ = Eigen::Vector2d::Zero();
  bool readout_is_known_ = false;   // by the calibration or the map
  double largest_rate_in_map_ = 0;  // while that is unknown: of this camera's images, radians per second
  const MapSnapshot* readout_map_ = nullptr;  // the snapshot that was read last, never dereferenced
  std::uint64_t readout_revision_ = 0;
  ReadoutEstimator readout_;
  Timestamp last_points_{};  // time of the last pose from map points
  // Smoothed velocity that no rotation about the pivot explains, camera frame, in median depths per second.
  Eigen::Vector3d drift_per_s_ = Eigen::Vector3d::Zero();
};

}  // namespace docent::engine

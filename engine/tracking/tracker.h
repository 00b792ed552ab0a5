// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "engine/base/random.h"
#include "engine/mapping/initializer.h"
#include "engine/mapping/keyframe_candidate.h"
#include "engine/mapping/target_initializer.h"
#include "engine/recognition/place.h"
#include "engine/tracking/descriptor_relocalizer.h"
#include "engine/tracking/frame_inspection.h"
#include "engine/tracking/keyframe_novelty.h"
#include "engine/tracking/keyframe_policy.h"
#include "engine/tracking/map_tracker.h"
#include "engine/tracking/motion_model.h"
#include "engine/tracking/rotation_center.h"
#include "engine/tracking/tracked_frame.h"
#include "engine/vision/features.h"

namespace docent::engine {

struct TrackerOptions {
  FeatureOptions features;
  MapTrackerOptions map_tracker;
  InitializerOptions initializer;
  // If given, maps are initialized from this planar target, in metres (hybrid-slam §5.5), instead of from two
  // arbitrary views.
  std::shared_ptr<const PlanarTarget> target;
  TargetStartOptions target_start;
  KeyFrameNoveltyOptions keyframes;
  KeyFramePolicyOptions keyframe_policy;
  RotationCenterOptions rotation_center;
  // Enables panorama maps (hybrid-slam): pure rotation is tracked by infinite points, and a new map starts as
  // a panorama map with its first image. If false, only general motion is tracked, as in ptamm.
  bool hybrid = false;
  // Low texture: if no more points than this can be searched, the rotation is tracked directly from all
  // pixels.
  int low_texture_points = 60;
  // Ratio of the image's variance that direct rotation tracking must explain.
  double min_explained_variance = 0.8;
  double min_image_overlap = 0.5;  // overlap with the image that the rotation is measured from
  // Longest time of direct rotation tracking without map points, in seconds: small errors accumulate.
  double max_direct_rotation_s = 5.0;
  double good_quality = 0.30;  // inlier ratio of good tracking quality (ptamm §2.1)
  double lost_quality = 0.13;  // inlier ratio below which a frame is lost (ptamm §2.1)
  // A pose with fewer inliers is rejected whatever its inlier ratio: patches that match by chance agree with
  // some pose too. When a camera left the map, poses with 20 to 30 inliers jumped by two degrees and more.
  int min_inliers = 30;
  // Enough if only the rotation is estimated, or if the inlier ratio reaches high_quality, as in low texture.
  int min_inliers_at_high_quality = 12;
  double high_quality = 0.5;
  // Consensus: a pose with this many inliers, this inlier ratio among the points found and this small a
  // residual is good whatever the ratio of points found, because in a dense part of a map most points may be
  // occluded or look different. Measured on frames below `good_quality`: true poses (an office, a flying
  // drone) had a sigma of 0.7-2.3 and 61-99 % inliers among the points found; chance matches had a sigma of
  // 3.8-15.
  int min_consensus_inliers = 60;    // twice `min_inliers`
  double min_consensus_ratio = 0.6;  // inliers over points found
  double max_consensus_sigma = 2.0;
  int min_cells = 3;  // cells of the 4x4 image grid with an inlier
  // Largest robust sigma of the normalised residuals: where nothing fits, the robust threshold grows until
  // chance matches pass it. A true pose has a sigma below 1.
  double max_sigma = 4.0;
  // The same for a pure rotation in a map with finite points: true rotations have less than half of it. If it
  // is exceeded for this many frames, the camera has translated and counts as lost, so that its translation
  // is not taken for rotation.
  double max_rotation_sigma = 1.0;
  int max_poor_rotation_frames = 5;
  // Lets the mapper's result for the last keyframe arrive in the map first.
  int frames_between_keyframes = 4;
  // Conditions on a pose that was found after a loss (ptamm §6.3).
  int min_recovery_inliers = 40;
  double min_recovery_quality = 0.25;
  int min_recovery_cells = 5;
  double short_loss_s = 2.0;  // time after a loss in which the last pose is tried first
  int max_retrieved = 10;  // Keyframes retrieved by thumbnail, each then aligned to the image by a rotation.
  int max_retrieved_per_map = 4;       // contained in max_retrieved
  std::size_t max_verified = 3;        // candidates of these that are verified per frame
  std::size_t max_competing_maps = 2;  // other maps that are verified as well, each by its best candidate
  // Best-to-second ratio of the qualities of two maps above which the best is accepted. It is accepted too
  // after it was better by any amount for min_leading_frames consecutive frames: overlapping maps both
  // explain the image and must not block each other for ever.
  double min_quality_ratio = 1.2;
  int min_leading_frames = 15;
  // Consecutive frames that must confirm a hypothesis before another map is entered (ptamm §6.3), and before
  // a map that was entered or found again is extended.
  int confirming_frames = 3;
  // Visible inlier ratio below which the pose may belong to another place of similar appearance: such a pose
  // needs confirmation, the map is not extended by it, and of overlapping maps that are not extended another
  // one may fit better (ptamm §5.3).
  double poor_visible_ratio = 0.5;  // inliers over all points in view, occluded ones included
  // Ratio by which another map or place must exceed that of the present one to be entered.
  double better_ratio = 1.3;
  // Interval of the search for such a map while the present quality is good.
  int frames_between_better_map_searches = 2;
  // Photometric tolerance ends when the standard comparison has at least this ratio of the last frame's
  // inliers; a smaller number than before may come from a different selection of points.
  double min_standard_ratio = 0.9;
  // With photometric tolerance, a pose after a loss with this many inliers and this small a residual needs
  // only `lost_quality`. Right poses had 69 to 193 inliers of 600 points and mostly a sigma of 0.8 to 1.3; a
  // wrong one had 81 inliers. In a thousand trials with images of other places no pose had a dozen inliers.
  int min_tolerant_inliers = 100;
  double max_tolerant_sigma = 1.2;
  // While maps are not extended, tracking continues with this few inliers if their residual is this small:
  // poses with 13 to 29 inliers and a sigma of 0.4 to 0.9 were right to 3 cm.
  int min_tight_inliers = 12;
  double max_tight_sigma = 1.0;
  bool build_maps = true;  // if false, a frame without a map is lost, not initializing
};

// Tracks one camera: initializes a map, tracks it, detects loss and relocalizes with the place finder. Used
// on its camera's thread only; never waits for the mapper. Not thread safe.
class Tracker {
 public:
  Tracker(const TrackerOptions& options, std::shared_ptr<const CameraModel> camera, std::uint64_t seed);

  // Sets the camera model of the frames from the next one on. If the model is being estimated, this has to be
  // called together with the SetMap that brings the first snapshot with this model. A running initialization
  // starts again.
  void SetCamera(std::shared_ptr<const CameraModel> camera);
  // Sets the newest snapshot of the tracked map, or another map; null for none, with map_key 0. In another
  // map the camera is lost at first, unless the map was initialized from this tracker's own initial pair.
  void SetMap(std::shared_ptr<const MapSnapshot> map, std::uint64_t map_key);
  // Discards the track and an initialization in progress.
  void Reset();
  // Starts the initialization of a new map; until SetMap provides one, frames are `initializing`.
  // search_known_maps: the camera was lost in another map. While it is tracked in the new map, the others are
  // searched as well, and one that explains the image is entered as after a loss.
  void StartNewMap(bool search_known_maps = false);
  bool starting() const { return starting_; }
  // The mapper could not make a map from the first view or the initial pair: the initialization continues.
  void StartFailed();

  // Processes one frame. `places` may be null: then a lost camera is searched in its own map only.
  TrackedFrame Track(const Frame& frame, const PlaceFinder* places);
  // The same, reusing the memory of *out: once its containers have the size of the map, a frame that is
  // tracked without loss allocates nothing.
  void Track(const Frame& frame, const PlaceFinder* places, TrackedFrame* out);

  // A record of the last frame, for debugging views. tracked: the result of Track.
  FrameInspection Inspect(const TrackedFrame& tracked) const;

  // What the last frame offers to the mapper. Each item is returned once.
  std::optional<KeyFrameCandidate> TakeKeyFrameCandidate();
  std::optional<InitialPair> TakeInitialPair();
  std::vector<PointReport> TakeReports();
  // After a relocalization in another map than the one that was set: that map's key. Its key and snapshot are
  // in the TrackedFrame, and the caller is expected to call SetMap() with the same key.
  std::uint64_t map_key() const { return map_key_; }

 private:
  // A retrieved keyframe and the camera pose that its alignment with the frame suggests.
  struct AlignedPlace {
    PlaceCandidate candidate;
    Rigid3 camera_from_map;
    double alignment_error = 0;  // of the thumbnails after alignment, grey values
  };
  std::shared_ptr<ImageFeatures> NextFeatures(const Frame& frame);
  void SearchInitialPair(const Frame& frame, TrackedFrame* out);
  // An initial pair of a keyframe of the panorama map and the present frame, matched by infinite points.
  // These survive when the camera rotates away and back, whereas the keypoint tracks of the initializer end.
  std::optional<InitialPair> TryPanoramaViews(const Frame& frame, const TrackedFrame& out);
  const KeyFrame* FindMaxParallaxKeyFrame(const TrackedFrame& out);
  // Runs the initializer in use: two arbitrary views or a planar target.
  std::optional<InitialPair> TrackStart(const Frame& frame, std::string* hint);
  void ResetStart();
  Timestamp FirstViewTime() const;
  void TrackMap(const Frame& frame, const PlaceFinder* places, TrackedFrame* out);
  // Selects the patch comparison of both map trackers.
  void SetComparison(PatchComparison comparison);
  // Tracks the map from the predicted pose. With photometric tolerance, tries the standard comparison from
  // time to time and keeps it if it succeeds.
  MapTrackResult TrackFromPrediction(const Rigid3& predicted);
  void EnterLostState(const Frame& frame, TrackedFrame* out);
  bool TrackRotationDirectly(const Frame& frame, const MapTrackResult& tried, TrackedFrame* out);
  PanoramaId PanoramaFor(const Rigid3& predicted) const;
  void ChooseKeyFrame(const Frame& frame, const MapTrackResult& result, const TrackedFrame& out);
  void OfferKeyFrame(KeyFrameChoice choice, const Frame& frame, const Rigid3& camera_from_map,
                     const std::vector<PointMatch>& matches);
  void Recover(const Frame& frame, const PlaceFinder* places, TrackedFrame* out);
  void SearchBetterMap(const Frame& frame, const PlaceFinder& places, TrackedFrame* out);
  void SearchBetterPlace(const Frame& frame, const PlaceFinder& places, TrackedFrame* out);
  void SearchKnownMaps(const Frame& frame, const PlaceFinder& places, TrackedFrame* out);
  // Tracks the hypothesis with `tracker`. Returns the map's snapshot, or null if it is not available.
  std::shared_ptr<const MapSnapshot> TrackHypothesis(const PlaceFinder& places, MapTracker* tracker,
                                                     MapTrackResult* result);
  MapTrackResult VerifyPlace(const AlignedPlace& place, MapTracker* tracker);
  // A place whose pose was verified in the frame.
  struct VerifiedPlace {
    AlignedPlace place;
    MapTrackResult result;
    PanoramaId panorama = kNoId;
  };
  // The first place that is verified in the frame, or a better one in the same map, and the best verified
  // place of a competing map; the better one first. The rejections of the others are recorded in `out`.
  std::vector<VerifiedPlace> VerifyPlaces(const PlaceFinder& finder, const std::vector<AlignedPlace>& places,
                                          TrackedFrame* out);
  // Replaces *found by the best place of its map; false if the best-to-second ratio in the map is too small.
  bool ReplaceByBetterPlace(const PlaceFinder& finder, VerifiedPlace* found, TrackedFrame* out);
  // The best other place of the map that is verified in the frame with a different pose.
  std::optional<VerifiedPlace> BestElsewhere(const PlaceFinder& finder, std::uint64_t map_key,
                                             const Rigid3& camera_from_map, KeyFrameId excluded_keyframe,
                                             TrackedFrame* out);
  // The best place that is verified in the frame in a map outside `excluded_maps`.
  std::optional<VerifiedPlace> BestCompetingMap(const std::vector<AlignedPlace>& places,
                                                std::set<std::uint64_t> excluded_maps, TrackedFrame* out);
  // Whether the best-to-second ratio is large enough in this frame, or the best map led in enough consecutive
  // frames.
  bool IsUnambiguous(std::uint64_t best_key, double best_quality, std::uint64_t second_key,
                     double second_quality);
  bool ContinueRelocalization(const Frame& frame, const PlaceFinder& places, TrackedFrame* out);
  void ReturnToMap(const Frame& frame, const VerifiedPlace& found, TrackedFrame* out);
  void SetUnconfirmed(const MapTrackResult& result, TrackedFrame* out) const;
  void EnterMap(const Frame& frame, std::shared_ptr<const MapSnapshot> map, const MapTrackResult& result,
                TrackedFrame* out);
  void BeginRelocalization(const VerifiedPlace& found);
  bool RecoverNearby(const Frame& frame, const PlaceFinder* places, TrackedFrame* out);
  // Places that resemble the frame by thumbnail, best alignment first. excluded_map: no place of that map;
  // the result is empty if the most similar keyframe is of that map.
  std::vector<AlignedPlace> BestPlaces(const PlaceFinder& places, std::uint64_t excluded_map = 0) const;
  // The first distinct places that resemble the frame by thumbnail and visual words, without the keyframes of
  // `tried`.
  std::vector<AlignedPlace> PlacesByWords(const PlaceFinder& places,
                                          const std::vector<AlignedPlace>& tried) const;
  // Places from descriptor matching, in maps that the visual words suggest.
  std::vector<AlignedPlace> PlacesByDescriptors(const PlaceFinder& places);
  std::optional<AlignedPlace> AlignPlace(const PlaceCandidate& candidate) const;
  bool IsAccepted(const MapTrackResult& result) const;
  bool HasWideConsensus(const MapTrackResult& result) const;
  bool FitsRotation(const MapTrackResult& result, const MapSnapshot& map) const;
  bool HoldsTrack(const MapTrackResult& result) const;
  // Why a pose that was found after a loss is rejected; kNone if it is accepted.
  RejectionReason RejectionReasonOf(const MapTrackResult& result, const MapSnapshot& map) const;
  double RequiredInlierRatio(const Frame& frame, const Rigid3& found_camera_from_map) const;
  void Accept(const Frame& frame, const MapTrackResult& result, TrackedFrame* out);
  void CollectReports();
  // Transforms everything in map coordinates by the corrections between the present snapshot and a newer one.
  void ApplyCorrections(const MapSnapshot& newer);
  std::optional<Rotation3> RotationFromPrevious() const;

  const TrackerOptions options_;
  std::shared_ptr<const CameraModel> camera_;
  Random random_;
  MapTracker map_tracker_;
  MapTracker competing_tracker_;  // of another map than the tracked one
  Initializer initializer_;
  std::optional<TargetInitializer> target_initializer_;
  MotionModel motion_;
  KeyFramePolicy keyframe_policy_;
  RotationCenter rotation_center_;
  PivotEstimate pivot_estimate_;  // pivot of the present rotation

  std::shared_ptr<const MapSnapshot> map_;
  std::uint64_t map_key_ = 0;
  bool starting_ = false;  // an initialization runs, or the mapper makes a map of its result
  bool search_known_maps_ = false;
  bool pair_given_ = false;  // the mapper makes a map of this tracker's pair
  bool tracking_ = false;
  // What the last pose determined. After kPanorama the camera centre is kept.
  ObservedMotion observed_ = ObservedMotion::kSixDof;
  PatchComparison comparison_ = PatchComparison::kStandard;
  int frames_lost_ = 0;                            // searched frames since the loss
  unsigned frames_tolerant_ = 0;                   // consecutive frames tracked with photometric tolerance
  int inliers_ = 0;                                // of the last frame
  double finite_coverage_ = 1, median_depth_ = 1;  // of the last frame with finite inliers
  double visible_inlier_ratio_ = 0;                // of the last frame
  double mean_visible_inlier_ratio_ = 1;           // exponential average over about ten frames
  Rigid3 first_view_from_map_;                     // pose of the initializer's first view
  // Rotation vector per frame, of the last tracked frame.
  Eigen::Vector3d rotation_rate_ = Eigen::Vector3d::Zero();
  std::vector<std::pair<Timestamp, Eigen::Vector3d>>
      keyframe_rotation_rates_;             // of the keyframes offered during initialization
  std::vector<PointMatch> sorted_matches_;  // scratch memory of FindMaxParallaxKeyFrame
  int frames_since_views_ = 0;              // frames since TryPanoramaViews last ran
  Timestamp lost_since_{};
  bool searched_ = false;         // whether a map was searched in the last frame
  int poor_rotation_frames_ = 0;  // consecutive frames whose residual no rotation explains
  // Frames that still have to explain the image since the last relocalization before the map is extended.
  int unconfirmed_frames_ = 0;
  double required_inlier_ratio_ = 0;  // visible inlier ratio that such a frame needs
  // Reference image of TrackRotationDirectly: the newest image whose pose came from map points or, in a long
  // rotation, a later one.
  std::shared_ptr<const ImageFeatures> rotation_reference_;
  Rigid3 rotation_reference_pose_;
  Timestamp last_points_{};  // time of the last pose from map points
  int frames_since_keyframe_ = 0;
  int frames_since_better_map_search_ = 0;
  unsigned frames_since_recovery_ = 0;  // while the relocalization is unconfirmed
  // The better of two maps that both explain the images, and for how many frames.
  std::uint64_t leader_key_ = 0;
  int leader_frames_ = 0;
  // Hypothesis in another map until enough frames confirm it.
  std::uint64_t hypothesis_key_ = 0;
  int hypothesis_frames_ = 0;
  Rigid3 hypothesis_pose_;
  PanoramaId hypothesis_panorama_ = kNoId;

  std::shared_ptr<const ImageFeatures> features_, previous_;
  std::vector<std::shared_ptr<ImageFeatures>> pool_;
  std::array<int, kPyramidLevels> fast_threshold_{};
  std::vector<PointReport> reports_;  // by ascending point
  // Reports of the present frame on points that reports_ did not contain.
  std::vector<PointReport> new_reports_;
  std::optional<KeyFrameCandidate> candidate_;
  std::optional<InitialPair> pair_;
  DescriptorRelocalizer descriptor_relocalizer_;
};

}  // namespace docent::engine

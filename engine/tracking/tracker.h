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
  // When given, maps start from this image, in metres (hybrid-slam §5.5), and not from any two views.
  std::shared_ptr<const PlanarTarget> target;
  TargetStartOptions target_start;
  KeyFrameNoveltyOptions keyframes;
  KeyFramePolicyOptions selector;
  RotationCenterOptions rotation_center;
  // Panorama maps (hybrid-slam): a turn on the spot is tracked by directions, and a new map begins as one
  // with its first image. Off: general motion alone, as in ptamm.
  bool hybrid = false;
  // A bare wall: where no more points than this can be looked for, a turn is followed by the whole image.
  int low_texture_points = 60;
  double min_image_agreement = 0.8;  // share of the image's variance that the turn must explain
  double min_image_overlap = 0.5;    // with the image that the turn is measured from
  double max_image_s = 5.0;          // without points in between: small errors add up
  double good_quality = 0.30;        // ptamm §2.1
  double lost_quality = 0.13;        // ptamm §2.1
  // Fewer do not make a pose, whatever their share: patches that fit by chance agree with some pose, too.
  // Where a map was being left, poses told by 20 to 30 points jumped by two degrees and more.
  int min_inliers = 30;
  // Enough where only the rotation is asked for, or where nearly all that was looked for is there: a bare
  // wall.
  int min_sure_inliers = 12;
  double sure_quality = 0.5;
  // A pose that so many points tell, that agree so well, is good whatever the share of those looked for: in a
  // crowded part of a map most points may be hidden or look different by now. Measured where the share was
  // below `good_quality`: true poses (an office, a flying drone) left a sigma of 0.7-2.3, and 61-99 % of the
  // points found were inliers; chance matches left a sigma of 3.8-15.
  int min_consensus_inliers = 60;    // twice `min_inliers`
  double min_consensus_ratio = 0.6;  // inliers of the points found
  double max_consensus_sigma = 2.0;
  int min_cells = 3;  // of the 4x4 grid that inliers must occupy
  // Robust, of the normalised residuals: where nothing fits, the robust threshold grows until chance matches
  // pass it. A true pose leaves less than one.
  double max_sigma = 4.0;
  // The same where a turn is to explain an image, in a map that knows depth: true turns leave less than half
  // of it. More, for so many frames, and the camera has gone from where it turned: then it is lost, rather
  // than its way taken for a turn.
  double max_turn_sigma = 1.0;
  int frames_of_misfit = 5;
  int frames_between_keyframes = 4;  // so that the mapper's answer to the last one is in the map
  // Recovery: what a pose found after a loss must show before it counts (ptamm §6.3).
  int min_recovery_inliers = 40;
  double min_recovery_quality = 0.25;
  int min_recovery_cells = 5;
  double short_loss_s = 2.0;       // within it the track is first sought where it was lost
  int max_retrieved = 10;          // keyframes that resemble the image, turned to fit it best
  int max_retrieved_per_map = 4;   // of these, at most
  std::size_t candidates = 3;      // the best of these are verified, each frame
  std::size_t competing_maps = 2;  // other maps that are tried as well, each by its best keyframe
  // Times the quality of the second best map, to be believed; or ahead of it by anything for so many frames
  // in a row: maps that overlap explain the image both, and must not keep each other out.
  double min_quality_ratio = 1.2;
  int min_leading_frames = 15;
  // Before another map is entered (ptamm §6.3), and before a map that was entered or found again is extended.
  int agreeing_frames = 3;
  // A map or a place seen worse than this may be another that is alike: what is found again so is confirmed
  // and not extended, and, of overlapping maps that do not grow, another one may fit better (ptamm §5.3).
  double poor_quality = 0.5;    // share of what is in view, hidden points among it
  double better_quality = 1.3;  // times that of the map that the camera is or was in, to be entered
  // For such a map, as long as the present one is well enough seen to be extended.
  int frames_between_better_map_searches = 2;
  // Tolerant comparison of patches is given up when the usual one finds this share of the points: that may be
  // less by what two choices of points differ, but no more.
  double standard_share = 0.9;
  // Under tolerant comparison so many points that fit so well are enough after a loss, if they are no small
  // share. Right poses had 69 to 193 of 600 and left 0.8 to 1.3 in most cases; a wrong one had 81. Of a
  // thousand tries with images of other places none found a dozen that agreed.
  int min_fitting_inliers = 100;
  double max_fitting_sigma = 1.2;
  // Visitors stay where they are by so few points when they fit so tightly: poses by 13 to 29 points that
  // left 0.4 to 0.9 were right to 3 cm.
  int min_tight_inliers = 12;
  double max_tight_sigma = 1.0;
  bool build_maps = true;  // else a frame without a map is lost, not initializing
};

// Tracks one camera: waits for a start, follows the map, notices loss and comes back by the place finder.
// IsActive on its camera's thread; never waits for the mapper. Not thread safe.
class Tracker {
 public:
  Tracker(const TrackerOptions& options, std::shared_ptr<const CameraModel> camera, std::uint64_t seed);

  // The newest state of the map being tracked, or another map to go to (then the track is lost at first,
  // unless the map starts from this tracker's own initial pair); null for none. map_key 0 means none.
  void SetMap(std::shared_ptr<const MapSnapshot> map, std::uint64_t map_key);
  // Forgets the start that is being waited for and the track.
  void Reset();
  // Begins to look for a new map's first views; until SetMap gives one, frames are `initializing`.
  // search_known_maps: the camera was lost in another map. While it is tracked in the new one, the others are
  // searched as well, and one that explains the image is entered as after a loss.
  void StartNewMap(bool search_known_maps = false);
  bool starting() const { return starting_; }
  // The first view and pose from which the mapper could not make a map were nothing: look on.
  void StartFailed();

  // The whole way of one frame. `places` may be null: then a lost track is sought in its own map only.
  TrackedFrame Track(const Frame& frame, const PlaceFinder* places);
  // The same into *out, whose memory is used again: once its containers have grown to the map, a frame that
  // is tracked without trouble allocates nothing.
  void Track(const Frame& frame, const PlaceFinder* places, TrackedFrame* out);

  // All about the last frame, for whoever looks for a fault; `tracked`: what Track answered.
  FrameInspection Inspect(const TrackedFrame& tracked) const;

  // What the last frame offers to the mapper; each is given out once.
  std::optional<KeyFrameCandidate> TakeKeyFrameCandidate();
  std::optional<InitialPair> TakeInitialPair();
  std::vector<PointReport> TakeReports();
  // When the last frame recovered into another map than the one that was set: its key and snapshot are in the
  // TrackedFrame, and SetMap() is expected to follow with the same key.
  std::uint64_t map_key() const { return map_key_; }

 private:
  // A keyframe that resembles the frame, and the pose that the resemblance suggests.
  struct AlignedPlace {
    PlaceCandidate candidate;
    Rigid3 camera_from_map;
    double misfit = 0;  // of the thumbnails, after turning
  };
  std::shared_ptr<ImageFeatures> NextFeatures(const Frame& frame);
  void SearchInitialPair(const Frame& frame, TrackedFrame* out);
  // A start from a keyframe of the panorama map and the present frame, matched by the map's directions: these
  // outlive the keypoint tracks of the initializer when the camera turns away and back.
  std::optional<InitialPair> TryPanoramaViews(const Frame& frame, const TrackedFrame& out);
  const KeyFrame* WidestPanoramaView(const TrackedFrame& out);
  // Whichever of the two ways to start a map is used.
  std::optional<InitialPair> TrackStart(const Frame& frame, std::string* hint);
  void ResetStart();
  Timestamp FirstViewTime() const;
  void TrackMap(const Frame& frame, const PlaceFinder* places, TrackedFrame* out);
  // How patches are compared from now on, in every map.
  void Compare(PatchComparison comparison);
  // The search from where the camera is expected; while patches are compared tolerantly, now and then by the
  // usual comparison, which stays where it does as well.
  MapTrackResult TrackFrom(const Rigid3& predicted);
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
  // Tracks the map that is about to be entered, in `tracker`; its snapshot, or null when it is not there.
  std::shared_ptr<const MapSnapshot> TrackHypothesis(const PlaceFinder& places, MapTracker* tracker,
                                                     MapTrackResult* result);
  MapTrackResult TryPlace(const AlignedPlace& place, MapTracker* tracker);
  // A place whose map explains the frame.
  struct FoundPlace {
    AlignedPlace place;
    MapTrackResult result;
    PanoramaId panorama = kNoId;
  };
  // The first of the places at which the frame is explained, or a better one in the same map, and the best
  // competitor of its map that explains it too, the better one first. Tells `out` what speaks against the
  // others.
  std::vector<FoundPlace> FindMaps(const PlaceFinder& finder, const std::vector<AlignedPlace>& places,
                                   TrackedFrame* out);
  // By the best of its map; false when that is not clearly ahead of the second best there.
  bool ReplaceByBetterPlace(const PlaceFinder& finder, FoundPlace* found, TrackedFrame* out);
  // The best of other places in a map at which the frame is explained, by another pose than this one.
  std::optional<FoundPlace> BestElsewhere(const PlaceFinder& finder, std::uint64_t map_key,
                                          const Rigid3& camera_from_map, KeyFrameId but_keyframe,
                                          TrackedFrame* out);
  // The best of other maps than these at which the frame is explained.
  std::optional<FoundPlace> BestCompetingMap(const std::vector<AlignedPlace>& places,
                                             std::set<std::uint64_t> but_maps, TrackedFrame* out);
  // Whether the best map is far enough before the second best, in this frame or in many in a row.
  bool IsUnambiguous(std::uint64_t best_key, double best_quality, std::uint64_t second_key,
                     double second_quality);
  bool ContinueRelocalization(const Frame& frame, const PlaceFinder& places, TrackedFrame* out);
  void Return(const Frame& frame, const FoundPlace& found, TrackedFrame* out);
  void SetUnconfirmed(const MapTrackResult& result, TrackedFrame* out) const;
  void Enter(const Frame& frame, std::shared_ptr<const MapSnapshot> map, const MapTrackResult& result,
             TrackedFrame* out);
  void BeginRelocalization(const FoundPlace& found);
  bool RecoverNearby(const Frame& frame, const PlaceFinder* places, TrackedFrame* out);
  // Those that resemble the frame by their thumbnails, the best first; but_map: none of that map, and none at
  // all when the most alike at first sight is of it.
  std::vector<AlignedPlace> BestPlaces(const PlaceFinder& places, std::uint64_t but_map = 0) const;
  // The first different places that resemble it by thumbnail and words, other keyframes than `tried`.
  std::vector<AlignedPlace> PlacesByWords(const PlaceFinder& places,
                                          const std::vector<AlignedPlace>& tried) const;
  // Where descriptors place the camera, in maps that the words of the image suggest.
  std::vector<AlignedPlace> PlacesByDescriptors(const PlaceFinder& places);
  std::optional<AlignedPlace> AlignPlace(const PlaceCandidate& candidate) const;
  bool IsAccepted(const MapTrackResult& result) const;
  bool HasWideConsensus(const MapTrackResult& result) const;
  bool IsTurn(const MapTrackResult& result, const MapSnapshot& map) const;
  bool HoldsTrack(const MapTrackResult& result) const;
  // Whether a pose that was found after a loss counts: kNone, or what speaks against it.
  RejectionReason RejectionReasonOf(const MapTrackResult& result, const MapSnapshot& map) const;
  double RequiredInlierRatio(const Frame& frame, const Rigid3& found_camera_from_map) const;
  void Accept(const Frame& frame, const MapTrackResult& result, TrackedFrame* out);
  void CollectReports();
  // Carries what the tracker knows in coordinates of its map over to a newer snapshot of it.
  void FollowCorrections(const MapSnapshot& newer);
  std::optional<Rotation3> RotationFromPrevious() const;

  const TrackerOptions options_;
  std::shared_ptr<const CameraModel> camera_;
  Random random_;
  MapTracker map_tracker_;
  MapTracker competing_tracker_;  // of another map, while one is tracked
  Initializer initializer_;
  std::optional<TargetInitializer> target_initializer_;
  MotionModel motion_;
  KeyFramePolicy selector_;
  RotationCenter rotation_center_;
  Turn turn_;  // that goes on

  std::shared_ptr<const MapSnapshot> map_;
  std::uint64_t map_key_ = 0;
  bool starting_ = false;  // a start is being looked for, or the mapper is making a map of it
  bool search_known_maps_ = false;
  bool pair_given_ = false;  // the mapper is making a map of our pair
  bool tracking_ = false;
  // The last pose told the rotation alone; then the centre stays where it was.
  ObservedMotion observed_ = ObservedMotion::kSixDof;
  PatchComparison comparison_ = PatchComparison::kStandard;
  int frames_lost_ = 0;                                  // that were searched since the loss
  unsigned frames_tolerant_ = 0;                         // in a row, that were tracked
  int inliers_ = 0;                                      // of the last frame
  double finite_coverage_ = 1, median_depth_ = 1;        // of the last frame that told them
  double visible_inlier_ratio_ = 0;                      // of the last frame
  double mean_visible_inlier_ratio_ = 1;                 // averaged over about the last ten frames
  Rigid3 first_view_from_map_;                           // the pose of the initializer's first view
  Eigen::Vector3d turn_rate_ = Eigen::Vector3d::Zero();  // rotation vector a frame, of the last tracked frame
  std::vector<std::pair<Timestamp, Eigen::Vector3d>>
      keyframe_turn_rates_;                 // of offered keyframes, while starting
  std::vector<PointMatch> sorted_matches_;  // scratch of WidestPanoramaView
  int frames_since_views_ = 0;              // that TryPanoramaViews was asked
  Timestamp lost_since_{};
  bool searched_ = false;  // a map, for the last frame
  int misfit_frames_ = 0;  // in a row, that no turn explains
  // That explain the image well, wanted since the last recovery before the map is extended.
  int doubtful_frames_ = 0;
  double required_inlier_ratio_ = 0;  // by a frame that counts for this
  // The newest image whose pose points told, or of a long turn a later one: TrackRotationDirectly's measure.
  std::shared_ptr<const ImageFeatures> anchor_;
  Rigid3 anchor_pose_;
  Timestamp last_points_{};  // when points told the pose
  int frames_since_keyframe_ = 0;
  int frames_since_better_map_search_ = 0;  // for a better map
  unsigned frames_since_recovery_ = 0;      // while it is doubted
  std::uint64_t leader_key_ = 0;            // of two maps that explain the images, for so many frames
  int leader_frames_ = 0;
  // Poses in another map that agree with each other, before it is entered.
  std::uint64_t hypothesis_key_ = 0;
  int hypothesis_frames_ = 0;
  Rigid3 hypothesis_pose_;
  PanoramaId hypothesis_panorama_ = kNoId;

  std::shared_ptr<const ImageFeatures> features_, previous_;
  std::vector<std::shared_ptr<ImageFeatures>> pool_;
  std::array<int, kPyramidLevels> fast_threshold_{};
  std::vector<PointReport> reports_;      // by ascending point
  std::vector<PointReport> new_reports_;  // of the present frame, of points that reports_ did not hold
  std::optional<KeyFrameCandidate> candidate_;
  std::optional<InitialPair> pair_;
  DescriptorRelocalizer descriptor_relocalizer_;
};

}  // namespace docent::engine

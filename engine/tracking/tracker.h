// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "engine/base/random.h"
#include "engine/mapping/keyframe_candidate.h"
#include "engine/recognition/place.h"
#include "engine/tracking/better_map_search.h"
#include "engine/tracking/feature_extractor.h"
#include "engine/tracking/frame_inspection.h"
#include "engine/tracking/keyframe_offers.h"
#include "engine/tracking/map_initialization.h"
#include "engine/tracking/point_reports.h"
#include "engine/tracking/pose_tracker.h"
#include "engine/tracking/relocalization_confirmation.h"
#include "engine/tracking/relocalizer.h"
#include "engine/tracking/tracked_frame.h"
#include "engine/tracking/tracker_options.h"
#include "engine/tracking/visual_odometry.h"

namespace docent::engine {

// Where a camera is, between two frames.
enum class CameraState : std::uint8_t {
  kNoMap,        // it searches all maps
  kStarting,     // a new map has neither a keyframe nor a point yet
  kTracked,      // in a map; while this has no finite points, its initialization goes on
  kRelocalized,  // tracked, but the relocalization is not confirmed: the map is not extended
  kLost,         // it has a map, but no pose in it
};

inline bool IsTracked(CameraState state) {
  return state == CameraState::kTracked || state == CameraState::kRelocalized;
}

// Tracks one camera: initializes a map, tracks it, detects loss and relocalizes with the place finder.
// Decides which of its parts works on a frame, and passes the pose on to the others. Used on its camera's
// thread only; never waits for the mapper. Not thread safe.
class Tracker {
 public:
  // Throws Error if the options are invalid.
  Tracker(const TrackerOptions& options, std::shared_ptr<const CameraModel> camera, std::uint64_t seed);

  // Sets the camera model of the frames from the next one on. If the model is being estimated, this has to be
  // called together with the SetMap that brings the first snapshot with this model. A running initialization
  // starts again.
  void SetCamera(std::shared_ptr<const CameraModel> camera);
  // Sets the newest snapshot of the tracked map, or another map; null for none, with map_key 0. In another
  // map the camera is lost at first, unless the map was initialized from this tracker's own initial pair.
  // When the camera relocalizes in another map, the TrackedFrame has that map's key and snapshot, and the
  // caller is expected to set it.
  void SetMap(std::shared_ptr<const MapSnapshot> map, std::uint64_t map_key);
  // While maps are only viewed: the newest state of the copy of the tracked map that the mapper extends with
  // the keyframes of this tracker (VisualOdometry); null if there is none.
  void SetOdometryCopy(std::shared_ptr<const MapSnapshot> copy) { odometry_.SetCopy(std::move(copy)); }
  // Whether the camera is followed in that copy.
  bool HasOdometry() const { return odometry_.is_active(); }
  // True once after that copy became invalid.
  bool TakeInvalidOdometryCopy() { return odometry_.TakeInvalidCopy(); }
  // Discards the track and an initialization in progress.
  void Reset();
  // Starts the initialization of a new map; until SetMap provides one, frames are `initializing`.
  // search_known_maps: the camera was lost in another map. While it is tracked in the new map, the others are
  // searched as well, and one that explains the image is entered as after a loss.
  void StartNewMap(bool search_known_maps = false);
  // Starts the initialization of the map without finite points that the camera is tracked in; nothing if it
  // is not tracked in such a map.
  void InitializeTrackedMap();
  // The mapper could not make a map from the first view or the initial pair: the initialization continues.
  void StartFailed() { initialization_.PairFailed(); }
  CameraState state() const { return state_; }

  // Processes one frame. `places` may be null: then a lost camera is searched in its own map only.
  TrackedFrame Track(const Frame& frame, const PlaceFinder* places);
  // The same, reusing the memory of *out: once its containers have the size of the map, a frame that is
  // tracked without loss allocates nothing.
  void Track(const Frame& frame, const PlaceFinder* places, TrackedFrame* out);

  // A record of the last frame, for debugging views. tracked: the result of Track.
  FrameInspection Inspect(const TrackedFrame& tracked) const;

  // What the last frame offers to the mapper. Each item is returned once. A candidate counts as refused
  // unless KeyFrameAccepted follows before the next frame; then the next frame that should become a keyframe
  // is offered. When the initial pair is refused, call StartFailed.
  std::optional<KeyFrameCandidate> TakeKeyFrameCandidate() {
    return options_.build_maps ? offers_.Take() : odometry_.offers().Take();
  }
  void KeyFrameAccepted();
  std::optional<InitialPair> TakeInitialPair() { return initialization_.TakePair(); }
  // Corners of the last images, from which the mapper estimates the readout time of the shutter.
  std::optional<TrackedCorners> TakeCorners() { return std::exchange(corners_, std::nullopt); }
  std::vector<PointReport> TakeReports() { return reports_.Take(); }

 private:
  void SearchLost(const Frame& frame, const PlaceFinder* places, TrackedFrame* out);
  // The pose of a lost frame by visual odometry; nothing where there is none.
  void ContinueByOdometry(const std::optional<MapTrackResult>& result, TrackedFrame* out);
  void SetPose(const MapTrackResult& result, bool good, TrackedFrame* out) const;
  void TrackMap(const Frame& frame, const PlaceFinder* places, TrackedFrame* out);
  void SearchBetterMaps(const PlaceFinder& places, TrackedFrame* out);
  void SearchInitialPair(TrackedFrame* out);
  void Use(const std::optional<FoundPose>& found, TrackedFrame* out);
  void Accept(const MapTrackResult& result, TrackedFrame* out);
  PoseSearch SearchIn(const PlaceFinder* places);

  const TrackerOptions options_;
  const PoseCriteria criteria_;
  std::shared_ptr<const CameraModel> camera_;
  Random random_;
  FeatureExtractor extractor_;
  PoseTracker pose_;
  MapInitialization initialization_;
  KeyFrameOffers offers_;
  PointReports reports_;
  PlaceRetrieval retrieval_;
  PlaceVerification verification_;
  MapHypothesis hypothesis_;
  Relocalizer relocalizer_;
  BetterMapSearch better_maps_;
  RelocalizationConfirmation confirmation_;
  VisualOdometry odometry_;
  unsigned frames_of_odometry_ = 0;

  CameraState state_ = CameraState::kNoMap;
  std::shared_ptr<const MapSnapshot> map_;
  std::uint64_t map_key_ = 0;
  bool search_known_maps_ = false;
  bool initializes_stored_map_ = false;  // and no new one, if the initialization is on
  CameraImage image_;                    // the last one
  std::optional<TrackedCorners> corners_;
  bool searched_ = false;  // whether a map was searched in it
};

}  // namespace docent::engine

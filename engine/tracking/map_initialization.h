// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/random.h"
#include "engine/initialization/initializer.h"
#include "engine/initialization/target_initializer.h"
#include "engine/tracking/camera_image.h"
#include "engine/tracking/tracked_frame.h"
#include "engine/tracking/tracker_options.h"
#include "engine/tracking/wide_baseline_views.h"

namespace docent::engine {

// Finds the two views that give a new map its first finite points: from two arbitrary views or a planar
// target, or from a keyframe of the panorama map that is tracked meanwhile. Used on the camera's thread.
class MapInitialization {
 public:
  enum class Phase {
    kOff,
    kSearching,
    kPairGiven,  // the mapper makes a map of the pair
  };

  MapInitialization(const TrackerOptions& options, std::shared_ptr<const CameraModel> camera,
                    std::uint64_t initializer_seed, std::uint64_t target_seed);

  // The search starts again with this model.
  void SetCamera(std::shared_ptr<const CameraModel> camera, Random* random);
  // The readout time of the rolling shutter; see ReadoutMotion.
  void SetReadout(const Eigen::Vector2d& readout_s) {
    initializer_.SetReadout(readout_s);
    wide_initializer_.SetReadout(readout_s);
  }
  void Begin();
  // Discards the search.
  void Stop();
  // The search begins again with the next image.
  void ForgetViews() { ResetViews(); }
  // The mapper made a map of the pair.
  void Finish() { phase_ = Phase::kOff; }
  // The mapper could not make a map of the pair, or refused it: the search continues.
  void PairFailed();
  // The mapper made a panorama map, whose first keyframe this is.
  void FirstIsMapped(Timestamp time, const Rigid3& camera_from_map);
  // A frame became a keyframe of the panorama map. rotation_rate: radians per frame.
  void AddKeyFrame(Timestamp time, const Eigen::Vector3d& rotation_rate);

  // Searches the pair in the next frame. map: the panorama map so far, or null; *out: the frame as it was
  // tracked in it, which receives state and hint. panorama: whose points were searched.
  void Search(const CameraImage& image, const MapSnapshot* map, PanoramaId panorama,
              const Eigen::Vector3d& rotation_rate, TrackedFrame* out);
  // The pair that the last frame completed, once.
  std::optional<InitialPair> TakePair() { return std::exchange(pair_, std::nullopt); }
  void BeginFrame() { pair_.reset(); }
  // To be called for each frame after the one that completed the pair: its corners, now and then, from which
  // the mapper estimates the readout time of the shutter.
  std::optional<TrackedCorners> FollowCorners(const CameraImage& image) {
    return initializer_.is_following() ? initializer_.Follow(image.time, image.features) : std::nullopt;
  }

  Phase phase() const { return phase_; }
  bool is_on() const { return phase_ != Phase::kOff; }

 private:
  void ResetViews();
  // Times of the initializer's first views; Timestamp::min() without one.
  Timestamp OldestFirstView() const;
  Timestamp NewestFirstView() const;
  Rigid3 FirstViewFromMap(Timestamp time) const;
  void RememberFirstView(Timestamp time, const Rigid3& camera_from_map);
  // Runs the initializer in use: two arbitrary views or a planar target.
  std::optional<InitialPair> TrackViews(const CameraImage& image, Hint* hint);
  // An initial pair of a keyframe of the panorama map and the present frame, matched by infinite points.
  // These survive when the camera rotates away and back, whereas the keypoint tracks of the initializer end.
  std::optional<InitialPair> TryPanoramaViews(const CameraImage& image, const MapSnapshot& map,
                                              PanoramaId panorama, const Eigen::Vector3d& rotation_rate,
                                              const TrackedFrame& tracked);
  // An initial pair of an image of a while ago and the present one, matched by descriptors.
  std::optional<InitialPair> TryWideBaseline(const CameraImage& image, const Eigen::Vector3d& rotation_rate,
                                             const TrackedFrame& tracked);
  const KeyFrame* FindMaxParallaxKeyFrame(const CameraImage& image, const MapSnapshot& map,
                                          PanoramaId panorama, const TrackedFrame& tracked);

  TrackerOptions options_;
  Initializer initializer_, wide_initializer_;  // The second only tries the views of wide_views_.
  WideBaselineViews wide_views_;
  std::optional<TargetInitializer> target_initializer_;
  Phase phase_ = Phase::kOff;
  // Poses of the initializer's first views, in the order of their times.
  std::vector<std::pair<Timestamp, Rigid3>> first_views_from_map_;
  std::optional<InitialPair> pair_;
  std::vector<std::pair<Timestamp, Eigen::Vector3d>> keyframe_rotation_rates_;  // of the panorama keyframes
  int frames_since_views_ = 0;              // since TryPanoramaViews last ran
  int frames_since_wide_views_ = 0;         // since TryWideBaseline last ran
  std::vector<PointMatch> sorted_matches_;  // scratch memory of FindMaxParallaxKeyFrame
};

}  // namespace docent::engine

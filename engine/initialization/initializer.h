// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/random.h"
#include "engine/initialization/corner_tracks.h"
#include "engine/initialization/initial_pair.h"
#include "engine/initialization/start_confirmation.h"
#include "engine/initialization/track_readout.h"

namespace docent::engine {

struct InitializerOptions {
  CornerTracksOptions tracks;
  // Median motion for a 640 pixel wide image, below which the geometry is not estimated.
  double min_motion_px = 8;
  int attempt_interval = 2;  // frames between two estimates of the geometry
  // While the readout time of the shutter is unknown, depth has to be significant as well if the shutter
  // rolls for so long, seconds, in any of the four directions of the image: a turn of one radian per second
  // displaces the first and the last row against each other by ten pixels, which looks like depth. 60 % of
  // the time between two images at 30 Hz; half as long around a known one. 0: a global shutter is assumed.
  double unknown_readout_s = 0.02;
  // Whether the readout time is estimated from the corners before the first map; not while the calibration of
  // the camera is unknown, since its errors look alike.
  bool estimate_readout = true;
  TrackReadoutOptions track_readout;
  TwoViewOptions two_view;
  StartConfirmationOptions confirmation;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Initializes a map from two views: tracks corners from a first view through the images and estimates the
// two-view geometry until it is reliable (ptamm §2.3) and a third view has confirmed it. In a scene of low
// texture, several first views are tried (CornerTracks). Until then hint() says what is missing. One per
// camera, on the tracker's thread.
class Initializer {
 public:
  // Estimates the readout time. Called only where two views have depth, since that takes long.
  using ReadoutSource = std::function<std::optional<TrackReadout>()>;

  Initializer(const InitializerOptions& options, std::shared_ptr<const CameraModel> camera,
              std::uint64_t seed);

  // Starts again from the next frame.
  void Reset();
  // Resets and uses another camera model from the next frame on.
  void SetCamera(std::shared_ptr<const CameraModel> camera);
  // The readout time of the rolling shutter; see ReadoutMotion.
  void SetReadout(const Eigen::Vector2d& readout_s) { readout_s_ = readout_s; }
  // Returns a pair once the geometry is reliable and confirmed; the next call starts again.
  std::optional<InitialPair> Track(Timestamp time, const std::shared_ptr<const ImageFeatures>& features);

  // The same for two views whose keypoints the caller has matched, such as the points of a panorama map in
  // one of its keyframes and in the current frame. ids: one per match, ascending. speed_change_px: difference
  // of the image speed between the two views, in pixels per frame. readout: ReadoutFromCorners of the camera.
  std::optional<InitialPair> TryViews(const InitialPair::View& a, const InitialPair::View& b,
                                      std::vector<InitialPair::Match> matches,
                                      std::span<const std::uint32_t> ids, double speed_change_px,
                                      const ReadoutSource& readout);
  // Estimated from the corners that are tracked since the oldest first view. Empty if they do not suffice, or
  // if the calibration of the camera states it. Estimated once per image, although all pairs of views ask for
  // it.
  std::optional<TrackReadout> ReadoutFromCorners();
  // The search ended with this pair, or with one of other views of the camera. If it does not know the
  // readout time, the corners are tracked on through the next images, which may determine it.
  void EndWith(const InitialPair& pair);
  bool is_following() const { return following_; }
  // To be called for each image while is_following(). Returns the corners when they have been
  // tracked in enough more images for another estimate.
  std::optional<TrackedCorners> Follow(Timestamp time, const std::shared_ptr<const ImageFeatures>& features);

  // Whether the views that were tried last have depth, which a third view has yet to confirm.
  bool awaits_confirmation() const { return awaits_confirmation_; }

  // The corners that are tracked, and their first views.
  const CornerTracks& tracks() const { return tracks_; }
  // Why there is no map yet; kNone right after Reset().
  Hint hint() const { return hint_; }
  // How close the camera has come to a map, from 0 (it has not moved) to 1, for a person who waits for it. It
  // falls slowly when an attempt is worse than the one before, so that it does not flicker.
  double progress() const { return progress_; }

 private:
  std::optional<InitialPair> Attempt(const CornerTracks::FirstView& first, Timestamp time,
                                     const std::shared_ptr<const ImageFeatures>& features);
  // Two views whose keypoints are matched. ids: one per match.
  struct MatchedViews {
    InitialPair::View a, b;
    std::vector<InitialPair::Match> matches;
    std::vector<std::uint32_t> ids;
    TwoViewOptions options;
    std::optional<ReadoutPrior> readout;
  };
  TwoViewOptions OptionsFor(double speed_change_px);
  // Removes matches without rays.
  static TwoViewResult EstimateGeometry(MatchedViews* views);
  std::optional<InitialPair> Solve(MatchedViews views, const ReadoutSource& readout,
                                   StartConfirmation* confirmation);
  // Gives the views the cameras that an estimate of the readout time implies. True if they have changed.
  bool UseReadout(const TrackReadout& readout, MatchedViews* views);
  // Largest displacement of a row by the rotation of an image in so many seconds, pixels.
  double DisplacementPx(const InitialPair::View& a, const InitialPair::View& b, double seconds) const;
  // Whether two views with depth have depth whatever the readout time is, as long as it is unknown.
  bool HasDepthWithAnyReadout(const MatchedViews& views) const;
  // The model of an image near the time of the newest two rotations.
  std::shared_ptr<const CameraModel> ImageCamera(const Eigen::Vector3d& newest,
                                                 const Eigen::Vector3d& other) const;
  void UpdateProgress(double progress);
  void ResetAttempts();
  void TrackCorners(Timestamp time, const std::shared_ptr<const ImageFeatures>& features);

  InitializerOptions options_;
  std::shared_ptr<const CameraModel> camera_;
  Random random_;
  CornerTracks tracks_;
  std::vector<StartConfirmation> confirmations_;  // by slot of the first view
  StartConfirmation views_confirmation_;
  Eigen::Vector2d readout_s_ = Eigen::Vector2d::Zero();
  // Of the newest image, once ReadoutFromCorners was called for it.
  std::optional<std::optional<TrackReadout>> readout_from_corners_;
  Hint hint_ = Hint::kNone;
  double progress_ = 0, attempt_progress_ = 0;  // attempt_progress_: of the last attempt alone
  bool awaits_confirmation_ = false;
  bool ended_ = false;      // with a pair
  bool following_ = false;  // tracks the corners after the pair
};

}  // namespace docent::engine

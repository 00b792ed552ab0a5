// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/readout_prior.h"
#include "engine/initialization/corner_sequence.h"
#include "engine/initialization/track_bundle.h"

namespace docent::engine {

struct TrackReadoutOptions {
  TrackBundleOptions bundle;
  int min_corners = 40;
  // While the camera moves uniformly, errors of the lens and of the corners look like a readout time. From 6
  // to 11 images of two cameras with a global shutter, 25 of 56 estimates were 8 ms or more; from 12 to 32
  // images, one of 41, with 8 ms.
  int min_images = 12;
  // Standard deviation of what does not decrease with the number of corners, since they drift alike, in
  // seconds per pixel of noise. With 24 to 32 images it was 1.3 to 2 ms at 0.05 pixels in simulated museums,
  // and 5 to 6 ms at 0.15 pixels in those of a drone and of a hand-held depth camera.
  double systematic_s_per_px = 0.03;
  // Above this robust standard deviation of the residuals the corners do not fit a rigid scene, or the
  // adjustment failed. It was 0.04 to 0.10 in simulated and 0.09 to 0.24 in recorded images; estimates above
  // 0.28 were wrong.
  double max_noise_px = 0.25;
  // The readout time is significant once it differs from zero by this many standard deviations and seconds.
  // Errors of a calibration looked like up to 3.5 ms in real recordings; this is twice that.
  double min_readout_sigmas = 3;
  double min_readout_s = 0.007;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// The readout time of a rolling shutter, estimated from the motion of corners.
struct TrackReadout {
  // Seconds, as in ReadoutMotion: rows are exposed one after another, or columns, so that one entry is zero.
  Eigen::Vector2d readout_s = Eigen::Vector2d::Zero();
  double sigma_s = 0;            // standard deviation of the other entry
  double noise_px = 0;           // robust standard deviation of the residuals
  std::vector<Timestamp> times;  // of the images
  // By image, as in ReadoutMotion: with the part of the translation that displaces the image like a rotation.
  std::vector<Eigen::Vector3d> rotation_rates;
};

// Estimates the readout time from corners in consecutive images of a camera that has moved little, by a
// TrackBundle. camera: without a readout. Empty if there are too few corners or images, or if no rigid scene
// fits. Deterministic. Takes 20 to 90 milliseconds for 30 images.
std::optional<TrackReadout> EstimateTrackReadout(const TrackReadoutOptions& options,
                                                 const CameraModel& camera, const CornerSequence& sequence);

// The readout time of an estimate; empty unless it is significant. An estimate near zero may be a failed
// adjustment.
std::optional<ReadoutPrior> SignificantReadout(const TrackReadoutOptions& options,
                                               const TrackReadout& estimate);

}  // namespace docent::engine

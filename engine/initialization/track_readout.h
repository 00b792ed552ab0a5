// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/readout_prior.h"
#include "engine/geometry/rigid3.h"

namespace docent::engine {

// Corners that one camera tracked through consecutive images. Each corner is in all images.
struct CornerSequence {
  struct Image {
    Timestamp time{};
    Rotation3 now_from_previous;  // approximate; not used of the first image
  };
  struct Corner {
    std::uint8_t level = 0;               // pyramid level on which it is tracked
    std::vector<Eigen::Vector2f> pixels;  // by image, level 0
  };
  std::vector<Image> images;  // their times ascend
  std::vector<Corner> corners;
};

// Corners with the camera that tracked them.
struct TrackedCorners {
  std::shared_ptr<const CameraModel> camera;  // without a readout
  CornerSequence sequence;
};

struct TrackReadoutOptions {
  int max_corners = 120;  // more take longer
  int min_corners = 40;
  // While the camera moves uniformly, errors of the lens and of the corners look like a readout time. From 6
  // to 11 images of two cameras with a global shutter, 25 of 56 estimates were 8 ms or more; from 12 to 32
  // images, one of 41, with 8 ms.
  int min_images = 12;
  // Standard deviation of the readout time before anything is known, seconds. Phones take 28 to 61 ms
  // (Ringaby and Forssen 2012), webcams about as long, a global shutter none.
  double prior_sigma_s = 0.03;
  // Smallest standard deviation of a pixel of level 0 that is assumed.
  double min_noise_px = 0.05;
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

// What the motion of corners tells of a rolling shutter.
struct TrackReadout {
  // Seconds, as in ReadoutMotion: rows are exposed one after another, or columns, so that one entry is zero.
  Eigen::Vector2d readout_s = Eigen::Vector2d::Zero();
  double sigma_s = 0;            // standard deviation of the other entry
  double noise_px = 0;           // robust standard deviation of the residuals
  std::vector<Timestamp> times;  // of the images
  // By image, as in ReadoutMotion: with the part of the translation that displaces the image like a rotation.
  std::vector<Eigen::Vector3d> rotation_rates;
};

// Estimates the readout time from corners in consecutive images of a camera that has moved little: a bundle
// adjustment of all poses, of one inverse distance per corner, and of the readout time, where each row sees
// the corner from the pose at which it was exposed (Im et al., "High Quality Structure from Small Motion for
// Rolling Shutter Cameras", ICCV 2015). Velocities are those between the adjusted poses of the neighbouring
// images, which follow the readout time; the errors of a calibration are estimated too, with priors. Starts
// from the rotations alone and one distance for all corners (Yu and Gallup, "3D Reconstruction from
// Accidental Motion", CVPR 2014). camera: without a readout. Empty if there are too few corners or images, or
// if no rigid scene fits. Deterministic. Takes 20 to 90 milliseconds for 30 images.
std::optional<TrackReadout> EstimateTrackReadout(const TrackReadoutOptions& options,
                                                 const CameraModel& camera, const CornerSequence& sequence);

// What an estimate tells; empty unless it is significant. An estimate near zero may be a failed adjustment.
std::optional<ReadoutPrior> SignificantReadout(const TrackReadoutOptions& options,
                                               const TrackReadout& estimate);

}  // namespace docent::engine

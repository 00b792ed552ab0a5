// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>

#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "engine/matching/pose_refinement.h"

namespace docent::engine {

struct ReadoutOptions {
  bool enabled = true;
  // Standard deviation of the readout time before anything is known, seconds. Phones take 28 to 61 ms
  // (Ringaby and Forssen 2012), webcams about as long, a global shutter none.
  double prior_sigma_s = 0.02;
  // Errors of map points persist from frame to frame, so that so many frames count as one.
  double correlated_frames = 10;
  // A readout time is used once it differs from zero by this many standard deviations and seconds, and from
  // then on follows changes of at least `min_change_s`. Errors of a calibration looked like up to 3.5 ms in
  // real recordings; this is twice that. A faster shutter counts as global.
  double min_sigmas = 4;
  double min_readout_s = 0.007;
  double min_change_s = 0.001;
  double min_rate = 0.1;  // radians per second; a slower rotation does not determine it
  int min_inliers = 60;   // finite points of a frame
  int max_points = 120;   // finite points used per frame; more cost time and add little

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Estimates the readout time of a camera's rolling shutter, along the columns and along the rows, from the
// residuals of tracked frames: a rotation displaces points by its rate times the delay of their pixel, which
// no pose explains. The map has to be right: where this camera builds it, the mapper estimates the readout
// time together with the map (CalibrateReadout). One per camera; used on its thread. Allocates nothing.
class ReadoutEstimator {
 public:
  explicit ReadoutEstimator(const ReadoutOptions& options);

  // A frame that was tracked with `camera`, which has the rotation rate of the frame. measurements: with the
  // weights of the pose. sigma: robust, of the normalized residuals. frame_s: time since the previous frame;
  // no readout takes longer.
  void Add(const CameraModel& camera, const Rigid3& camera_from_map,
           std::span<const PoseMeasurement> measurements, double sigma, double frame_s);

  // The readout time to use, seconds; see ReadoutMotion. Zero until it is significant.
  const Eigen::Vector2d& readout_s() const { return used_s_; }
  // The estimate and its standard deviation, seconds.
  Eigen::Vector2d estimate_s() const;
  Eigen::Vector2d sigma_s() const;

 private:
  Eigen::Matrix2d Covariance() const;
  void Use(std::optional<Eigen::Index> only, double frame_s);

  ReadoutOptions options_;
  Eigen::Matrix2d information_ = Eigen::Matrix2d::Zero();  // 1 / seconds squared
  Eigen::Vector2d weighted_ = Eigen::Vector2d::Zero();     // information times readout time
  Eigen::Vector2d used_s_ = Eigen::Vector2d::Zero();
};

}  // namespace docent::engine

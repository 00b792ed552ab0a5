// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <opencv2/core/mat.hpp>

#include "engine/matching/point_match.h"
#include "engine/tracking/tracked_frame.h"

namespace docent::ui {

// What a camera does to an image besides exposing it; by default nothing. Pixels are those of the camera's
// image.
struct ImageDegradation {
  float noise = 0;  // Standard deviation of the noise of a pixel, as a part of the greatest grey level.
  std::uint32_t noise_seed = 0;  // Another one for each image.
  // How far the image of a thing at pixel (x, y) moves during the exposure, in pixels: motion * (x, y, 1).
  glm::mat3x2 motion{0.0f};
  // Logarithm of the light in the corners over that in the middle; it changes with the square of the distance
  // from the middle. Negative where the lens darkens the corners.
  float shading = 0;
  // Square of the distance from the middle, in half diagonals, at which the exposure was measured.
  float shading_reference = 0;
};

// Estimates noise and motion blur of the live image, so that content can be drawn with them.
//
// The noise is that of the smoothest blocks of the image, by the operator of Immerkaer (Fast Noise Variance
// Estimation, 1996). The motion of the image is an affine function of the pixel, fitted to the map points of
// two successive images. The exposure time follows from how much less the grey levels of the live image
// change along the motion than those of the keyframes do; the median of several images counts. Neither noise
// that compression has removed nor a lens out of focus is modelled. Allocates nothing. Single thread.
class DegradationEstimator {
 public:
  // Of this frame, without the shading; null or a frame without a pose: no motion.
  const ImageDegradation& Update(const engine::TrackedFrame* tracked);
  // The exposure time that is assumed, in seconds; 0 before it is known.
  double exposure_s() const { return exposure_s_; }

 private:
  static constexpr std::size_t kMaxPoints = 1024, kRememberedExposures = 31;
  struct Seen {
    engine::MapPointId point;
    glm::vec2 pixel;
  };
  void EstimateNoise(const cv::Mat& image);
  // Fits `flow_per_frame_` to the points that both frames show; false if there are too few.
  bool EstimateMotion(const engine::TrackedFrame& tracked);
  void EstimateExposure(const engine::TrackedFrame& tracked, double interval_s);

  std::array<Seen, kMaxPoints> before_{}, now_{};
  std::size_t before_count_ = 0, now_count_ = 0;
  std::uint64_t map_key_ = 0;
  double before_s_ = 0;
  glm::mat3x2 flow_per_frame_{0.0f};
  bool knows_noise_ = false;
  // Of the last images that moved enough, of which the median counts.
  std::array<double, kRememberedExposures> exposures_s_{};
  std::size_t exposure_count_ = 0;
  double exposure_s_ = 0;
  ImageDegradation degradation_;
};

}  // namespace docent::ui

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <opencv2/core/mat.hpp>
#include <span>

#include "engine/tracking/tracked_frame.h"

namespace docent::ui {

// How the live image is exposed and balanced, so that content is drawn as the camera would have taken it. The
// exposure is that of the image relative to the keyframes, from the map points that both show. The white
// balance is relative to white light, from the brightest parts of the image, half of which counts, because a
// camera has most often balanced the image already. The shading of the lens, a parabola of the distance from
// the middle, follows from points that are elsewhere in the image than in their keyframes. Allocates nothing.
// Single thread.
class VideoExposure {
 public:
  // Factors of red, green and blue light for this frame; null: those of the frame before. While fewer points
  // are tracked than are needed, and before the first frame, nothing changes.
  const glm::vec3& Update(const engine::TrackedFrame* tracked);
  // As in ImageDegradation; 0 before anything is known.
  double shading() const { return shading_; }
  double shading_reference() const { return shading_reference_; }

 private:
  static constexpr std::size_t kMaxPoints = 200;
  // Of the linear brightness of a point to that in its keyframe, with the squared distances from the middle
  // of both images, in half diagonals.
  struct Ratio {
    double value = 0, now = 0, then = 0;
  };
  void EstimateShading(double gain, std::span<const Ratio> ratios);
  // The median of the ratios of a frame's points; 0 if there are too few.
  double GainOf(const engine::TrackedFrame& tracked);
  void Balance(const cv::Mat& bgr);

  std::array<Ratio, kMaxPoints> ratios_{};
  Eigen::Matrix2d shading_normal_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d shading_right_ = Eigen::Vector2d::Zero();
  double shading_ = 0, shading_reference_ = 0;
  std::uint64_t map_key_ = 0;
  bool is_known_ = false;
  double log_gain_ = 0;
  glm::dvec3 log_balance_{0};
  glm::vec3 exposure_{1};
};

}  // namespace docent::ui

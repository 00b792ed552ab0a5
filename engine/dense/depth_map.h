// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "engine/map/map_snapshot.h"

namespace docent::engine {

// The rays of the pixels of one pyramid level of a camera, for any lens model. Immutable; any thread.
class LevelRays {
 public:
  // Whether the rays take memory, 12 bytes a pixel, or are computed whenever At() asks for one. They are
  // equal.
  enum class Storage { kStored, kComputed };
  LevelRays(const CameraModel& camera, int level, Storage storage = Storage::kStored);

  int width_px() const { return width_px_; }    // of the level
  int height_px() const { return height_px_; }  // of the level
  int level() const { return level_; }
  // Unit length in the camera frame; zero if the lens has no ray for the pixel.
  Eigen::Vector3f At(int x, int y) const {
    if (!is_stored()) return Compute(x, y);
    return rays_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px_) +
                 static_cast<std::size_t>(x)];
  }
  bool is_stored() const { return !rays_.empty(); }
  // The pixel of the level at which a point in the camera frame is seen; empty if outside the image.
  std::optional<Eigen::Vector2d> Project(const Eigen::Vector3d& point_in_camera) const;

 private:
  Eigen::Vector3f Compute(int x, int y) const;

  CameraModel camera_;
  int level_, width_px_, height_px_;
  std::vector<Eigen::Vector3f> rays_;
};

// The distances of the surfaces that a keyframe sees, along the ray of each pixel of a pyramid level, so that
// lenses with any field of view have them.
struct DepthMap {
  KeyFrameId keyframe = kNoId;
  Rigid3 camera_from_map;  // of the keyframe when the depth was estimated
  std::shared_ptr<const LevelRays> rays;
  cv::Mat inverse_distance;  // CV_32FC1, 1 / map units; 0 where it is not known
  cv::Mat confidence;        // CV_8UC1; 0 where it is not known, 255 for a surface that is certain
  double step = 0;           // Resolution of the search: difference of inverse distances next to each other.
};

// The inverse distance at a pixel (of the level, not rounded) of the nearest whole pixel; 0 if it is not
// known or outside.
inline float InverseDistanceAt(const DepthMap& depth, const Eigen::Vector2d& pixel) {
  const auto x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
  if (x < 0 || y < 0 || x >= depth.inverse_distance.cols || y >= depth.inverse_distance.rows) return 0;
  return depth.inverse_distance.at<float>(y, x);
}

}  // namespace docent::engine

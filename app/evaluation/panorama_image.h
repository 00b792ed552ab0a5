// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "engine/map/map_snapshot.h"

// Stitches the keyframes of a panorama map into one image (hybrid-slam Fig. 6). For reports; any thread.
namespace docent::app {

struct StitchOptions {
  double pixels_per_radian = 300;  // 360 degrees are 1885 pixels wide.
  // A localized panorama keyframe is included when its centre is within this distance of the panorama centre,
  // as a ratio of the reference's median depth; at that distance parallax is not visible.
  double max_center_distance = 0.05;
};

// An equirectangular image: columns are yaw angles to the right about the map's up direction, rows are pitch
// angles downwards, both with options.pixels_per_radian. Cropped to the area covered by the keyframes.
struct PanoramaImage {
  engine::PanoramaId panorama = engine::kNoId;
  int keyframes = 0;  // Number of keyframes stitched.
  cv::Mat image;      // CV_8UC1; 0 where no keyframe covers the pixel.
  cv::Mat shown;      // CV_8UC1; 255 where a keyframe covers the pixel.
  double pixels_per_radian = 0;
  engine::Rotation3 view_from_map;  // x right, y down, z at yaw 0.
  double left_rad = 0,
         top_rad = 0;  // Yaw of the first column and pitch of the first row (negative: upwards).

  // Pixel of a direction in the map; it may be outside of the image. The yaw angle wraps around.
  Eigen::Vector2d PixelOf(const Eigen::Vector3d& direction_in_map) const;
};

// Stitches one image for each panorama centre with at least two keyframes, in the order of the panorama maps.
std::vector<PanoramaImage> StitchPanoramas(const engine::MapSnapshot& map, const StitchOptions& options = {});

// Encodes an image as PNG. Throws Error.
std::vector<std::uint8_t> EncodePng(const cv::Mat& image);

}  // namespace docent::app

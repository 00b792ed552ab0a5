// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "engine/map/map_snapshot.h"

// What a map knows about one place by turning there, stitched into an image (hybrid-slam Fig. 6). For
// reports; any thread.
namespace docent::app {

struct StitchOptions {
  double pixels_a_radian = 300;  // a whole turn is 1885 pixels wide
  // A keyframe that was localized since belongs to the image where it was taken within this part of the
  // reference's depth: there the eye sees no parallax.
  double same_place = 0.05;
};

// Equirectangular: columns are turns to the right about the map's upward direction, rows are turns downwards,
// both of options.pixels_a_radian. Cut to what its keyframes show.
struct PanoramaImage {
  engine::PanoramaId panorama = engine::kNoId;
  int keyframes = 0;  // that it is made of
  cv::Mat image;      // CV_8UC1; 0 where no keyframe looks
  cv::Mat shown;      // CV_8UC1; 255 where one does
  double pixels_a_radian = 0;
  engine::Rotation3 view_from_map;   // x right, y down, z where the turns are counted from
  double left_rad = 0, top_rad = 0;  // turn of the first column, and of the first row (negative: upwards)

  // The pixel at which a direction of the map lies, perhaps outside; turns wrap around.
  Eigen::Vector2d PixelOf(const Eigen::Vector3d& direction_in_map) const;
};

// One image a place where the camera turned, that is of at least two keyframes, in the order of their
// panorama maps.
std::vector<PanoramaImage> StitchPanoramas(const engine::MapSnapshot& map, const StitchOptions& options = {});

// The bytes of a PNG file.
std::vector<std::uint8_t> EncodePng(const cv::Mat& image);

}  // namespace docent::app

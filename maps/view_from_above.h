// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "engine/map/map_snapshot.h"

namespace docent::maps {

struct ViewFromAboveOptions {
  int size_px = 1024;  // of the image's longer side
  int margin_px = 48;
  double ignored_part =
      0.01;  // of the points at either end of each axis, so that strays do not shrink the rest
};

// From the map to the plan's two axes, right and down, which lie across `up`; the first keyframe looks up the
// sheet. The map has a keyframe.
Eigen::Matrix<double, 2, 3> SheetFromMap(const engine::MapSnapshot& map, const Eigen::Vector3d& up);

// The plan of a map: its finite points seen along `up` (unit length, in the map), its keyframes as small
// triangles that point where they look (the first red, panorama keyframes green, the others blue), and a bar
// of a round length in units of the map, which are metres only where it was started from something of known
// width. CV_8UC3 in BGR. A pure function; a map without keyframes gives an empty sheet.
cv::Mat DrawFromAbove(const engine::MapSnapshot& map, const Eigen::Vector3d& up,
                      const ViewFromAboveOptions& options = {});

}  // namespace docent::maps

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "engine/map/map_snapshot.h"

namespace docent::maps {

struct ViewFromAboveOptions {
  int size_px = 1024;  // The longer side of the image.
  int margin_px = 48;
  // Ratio of the points ignored at either end of each axis, so that outliers do not shrink the plan.
  double ignored_ratio = 0.01;
};

// The projection from the map to the axes of the plan (right, down): engine::UprightAxes, with `ahead`
// pointing up in the plan.
Eigen::Matrix<double, 2, 3> SheetFromMap(const engine::MapSnapshot& map);

// Draws a plan of a map: its finite points projected along engine::UpInMap, its keyframes as
// small triangles that point in the viewing direction (the first red, panorama keyframes green, the others
// blue), and a scale bar of a round length in map units, which are metres only if a known width gave the
// scale. Returns CV_8UC3 in BGR; an empty plan for a map without keyframes. A pure function.
cv::Mat DrawFromAbove(const engine::MapSnapshot& map, const ViewFromAboveOptions& options = {});

}  // namespace docent::maps

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "engine/dense/depth_map.h"
#include "engine/dense/semi_global.h"

namespace docent::engine {

// An image that takes part in a plane sweep.
struct SweepView {
  const cv::Mat* image = nullptr;   // CV_8UC1, of the level of `rays`
  const LevelRays* rays = nullptr;  // of its camera
  Rigid3 camera_from_map;           // map units
};

// Inverse distances from the reference camera, evenly spaced: the first plane is the farthest.
struct SweepPlanes {
  double first = 0, step = 0;  // 1 / map units
  int count = 0;

  double InverseDistance(double plane) const { return first + step * plane; }
};

// Planes between two inverse distances, so that a surface moves by about a pixel of the level from plane to
// plane in the neighbour with the longest baseline; at most max_count.
SweepPlanes SpacePlanes(const SweepView& reference, const std::vector<SweepView>& neighbours,
                        double min_inverse_distance, double max_inverse_distance, int max_count);

// The plane sweep (Collins 1996): for each plane, the neighbours' images are warped into the reference image
// through the lens models, and compared by the census transform (Zabih and Woodfill 1994), which does not
// depend on exposure. The cost of a pixel is that of the better half of the neighbours that see it, since the
// others may see something in front. Stops early, with an incomplete result, when asked to.
CostVolume SweepCosts(const SweepView& reference, const std::vector<SweepView>& neighbours,
                      const SweepPlanes& planes, const std::atomic<bool>* interrupt);

}  // namespace docent::engine

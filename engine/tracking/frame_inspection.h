// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "engine/geometry/rigid3.h"
#include "engine/map/map_snapshot.h"

// A full record of what the tracker did with one frame, for debugging views. Plain data, created on demand
// after the frame on the tracker's thread; the frame loop does not depend on it.
namespace docent::engine {

// A map point that was searched in a frame.
struct InspectedPoint {
  MapPointId point = kNoId;                             // of TrackedFrame::map
  bool infinite = false;                                // whether only its direction is known
  int level = 0;                                        // pyramid level of the search
  Eigen::Vector2d predicted = Eigen::Vector2d::Zero();  // centre of the search, level-0 pixels
  std::optional<Eigen::Vector2d> found;                 // level-0 pixel; empty if not found
  // Found pixel minus the projection with the final pose, in level-0 pixels; empty if the point does not
  // project.
  std::optional<Eigen::Vector2d> residual_px;
  double weight = 0;    // weight of the robust estimate; 0 for an outlier
  bool inlier = false;  // whether the pose agrees with it
};

// How a frame was tracked, for reports; see System::Inspect.
struct FrameInspection {
  // The pose that the last search started from; empty if no map was searched in this frame.
  std::optional<Rigid3> predicted;
  std::vector<InspectedPoint> points;  // points of the last search, in search order
  int visible_points = 0;              // number of finite points that `predicted` projects into the image
  PanoramaId panorama = kNoId;         // panorama map whose infinite points were searched
  std::shared_ptr<const ImageFeatures> features;  // null before the first image
};

}  // namespace docent::engine

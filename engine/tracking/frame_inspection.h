// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "engine/geometry/rigid3.h"
#include "engine/map/map_snapshot.h"

// What the tracker did with one frame, in full, for whoever looks for a fault. Plain data, made on demand
// after the frame on the tracker's thread; nothing in the frame loop depends on it.
namespace docent::engine {

struct InspectedPoint {
  MapPointId point = kNoId;
  bool infinite = false;
  int level = 0;                                        // of the pyramid, on which it was looked for
  Eigen::Vector2d predicted = Eigen::Vector2d::Zero();  // pixel of level 0 where it was looked for
  std::optional<Eigen::Vector2d> found;                 // pixel of level 0
  // Of what was found: from where the final pose puts the point; empty where that puts it nowhere.
  std::optional<Eigen::Vector2d> residual_px;
  double weight = 0;  // of the robust estimate; 0 for an outlier
  bool inlier = false;
};

struct FrameInspection {
  // The guess that the last search began with; empty when no map was searched in this frame.
  std::optional<Rigid3> predicted;
  std::vector<InspectedPoint> points;             // that were looked for in the last search, in its order
  int visible_points = 0;                         // finite ones that the guess puts into the image
  PanoramaId panorama = kNoId;                    // whose infinite points were looked for
  std::shared_ptr<const ImageFeatures> features;  // of the image; null before the first one
};

}  // namespace docent::engine

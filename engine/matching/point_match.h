// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "engine/map/map_snapshot.h"

namespace docent::engine {

// A point that was found in the frame, for overlays and reports.
struct PointMatch {
  MapPointId point = kNoId;                         // of TrackedFrame::map
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // level 0
  std::uint8_t level = 0;                           // pyramid level on which it was found
  bool inlier = false;                              // whether the pose agrees with it
};

}  // namespace docent::engine

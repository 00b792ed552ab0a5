// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"

namespace docent::engine {

// Corners that one camera tracked through consecutive images. Each corner is in all images.
struct CornerSequence {
  struct Image {
    Timestamp time{};
    Rotation3 now_from_previous;  // approximate; not used of the first image
  };
  struct Corner {
    std::uint8_t level = 0;               // pyramid level on which it is tracked
    std::vector<Eigen::Vector2f> pixels;  // by image, level 0
  };
  std::vector<Image> images;  // their times ascend
  std::vector<Corner> corners;
};

// Corners with the camera that tracked them.
struct TrackedCorners {
  std::shared_ptr<const CameraModel> camera;  // without a readout
  CornerSequence sequence;
};

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "engine/base/time.h"
#include "engine/geometry/camera_model.h"
#include "engine/geometry/rigid3.h"
#include "engine/vision/image_pyramid.h"

namespace docent::engine {

// The present image of a camera and the one before it, as all parts of its tracker use them.
struct CameraImage {
  Timestamp time{};
  std::shared_ptr<const CameraModel> camera;  // once it is tracked, with its motion during the readout
  std::shared_ptr<const ImageFeatures> features;
  std::shared_ptr<const ImageFeatures> previous;  // null for the first image
  // The previous image was delivered again, with another time: recordings of 15 images a second are stored
  // with 30 like this. The camera moves on, but nothing is to be measured from this image.
  bool is_repeated = false;

  // The rotation since the previous image, by aligning the thumbnails; empty if they do not match.
  std::optional<Rotation3> RotationFromPrevious() const;
};

}  // namespace docent::engine

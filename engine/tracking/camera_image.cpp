// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/camera_image.h"

#include "engine/vision/rotation_alignment.h"

namespace docent::engine {

std::optional<Rotation3> CameraImage::RotationFromPrevious() const {
  if (!previous) return std::nullopt;
  const auto aligned = AlignRotation(previous->small_blurry, *camera, features->small_blurry, *camera);
  if (!aligned || !aligned->converged) return std::nullopt;
  return aligned->b_from_a;
}

}  // namespace docent::engine

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "engine/tracking/camera_image.h"
#include "engine/vision/features.h"
#include "tests/engine/rendered_world.h"

namespace docent::engine::testing_world {

// What Camera() sees of a world from this pose, as frame `index` of a 30 Hz camera.
inline CameraImage ImageAt(const Rigid3& camera_from_world, int index = 0,
                           const RenderedWorld& world = World()) {
  const Frame frame = MakeFrame(index, world, camera_from_world);
  CameraImage image;
  image.time = frame.time;
  image.camera = Camera();
  image.features = MakeFeatures(frame.image);
  return image;
}

}  // namespace docent::engine::testing_world

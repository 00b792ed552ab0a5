// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "engine/base/time.h"
#include "engine/geometry/rigid3.h"
#include "engine/geometry/sim3.h"

// The times and the map of made-up runs with a known truth.
namespace docent::app {

// Of a frame, at 30 frames per second.
inline Timestamp TimeOf(int frame) {
  return Timestamp(frame * 33'333'333LL);
}

// The transform of an error-free map with an arbitrary frame and scale.
inline const engine::Sim3 kTruthFromMap = [] {
  engine::Sim3 transform;
  transform.rotation = engine::Rotation3::Exp({0.5, -1, 0.2});
  transform.translation = {3, -4, 5};
  transform.scale = 2.5;
  return transform;
}();

// The camera_from_map pose in that map.
inline engine::Rigid3 CameraFromMap(const engine::Rigid3& truth_from_camera) {
  return engine::Rigid3(kTruthFromMap.rotation.inverse() * truth_from_camera.rotation,
                        kTruthFromMap.inverse() * truth_from_camera.translation)
      .inverse();
}

}  // namespace docent::app

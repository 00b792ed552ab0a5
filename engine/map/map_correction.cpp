// SPDX-License-Identifier: Apache-2.0
#include "engine/map/map_correction.h"

namespace docent::engine {

Rigid3 CorrectedPose(const Rigid3& camera_from_map, const Sim3& after_from_before) {
  const Rotation3 rotation = camera_from_map.rotation * after_from_before.rotation.inverse();
  return {rotation,
          after_from_before.scale * camera_from_map.translation - rotation * after_from_before.translation};
}

}  // namespace docent::engine

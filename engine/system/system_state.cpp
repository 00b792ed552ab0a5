// SPDX-License-Identifier: Apache-2.0
#include "engine/system/system_state.h"

#include <algorithm>

namespace docent::engine {

Timestamp SystemState::LastTime() const {
  Timestamp time{};
  for (const SystemCamera& camera : cameras) time = std::max(time, camera.last_time);
  return time;
}

}  // namespace docent::engine

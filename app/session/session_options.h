// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "engine/base/time.h"
#include "engine/system/system_options.h"
#include "maps/library/map_pager.h"

namespace docent::app {

// What hides content behind it.
enum class Occlusion {
  kOff,      // Nothing.
  kProxies,  // The occluders that authors place.
  kMap,      // Also the surfaces of maps, as far as they are known.
};

// extend_maps and new_map_key are set by the session.
struct SessionOptions : engine::SystemOptions {
  bool may_write = true;  // false: no map is extended and no content is edited
  std::string first_map;  // a map of this name is started without a command; empty: wait for `map new`
  // In image time. A map is also saved when it is left and at the end; 0 saves only then.
  Timestamp autosave_interval = std::chrono::seconds(10);
  // Called each time that something is on disk, on the saver's thread or that of a command, which may hold
  // the session's mutex. May be empty.
  std::function<void()> on_saved;
  // Idle maps in memory are adjusted while there is nothing else to do; needs `threaded`.
  bool maintenance = true;
  // With kMap and `maintenance`, the surfaces of maps are computed.
  Occlusion occlusion = Occlusion::kMap;
  // Models have the light of the room, as far as it is known, and cast shadows on it; or else a fixed light.
  bool room_light = true;
  double signpost_height = 0.12;  // ratio of its distance at placement
  double model_side = 0.2;        // the same for the largest side of a model without a scale
  maps::PagerOptions memory;      // how much of the library is in memory at once
  // Measured distance in metres between the first two cameras of a rigid rig; 0 when not measured. Once the
  // rig is recognized, a map without a scale gets its scale from it.
  double baseline_m = 0;
};

}  // namespace docent::app

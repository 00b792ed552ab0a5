// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "engine/base/time.h"
#include "engine/mapping/mapper_options.h"
#include "engine/system/provisional_map.h"
#include "engine/tracking/tracker.h"

namespace docent::engine {

// What a System is made with. Fields of `tracker` and `mapper` are tuned together and may change with any
// version, except tracker.hybrid, tracker.target and mapper.lens.
struct SystemOptions {
  TrackerOptions tracker;   // build_maps is set by the system from extend_maps
  MapperOptions mapper;     // initialization, keyframes, adjustment, loops, unknown lenses
  bool threaded = true;     // mapper on its own thread; false: lockstep, runs are byte-identical
  bool extend_maps = true;  // false: known maps are tracked and never changed
  std::uint64_t seed = 1;   // of the random choices of robust estimation; equal seeds give equal runs
  ProvisionalMapOptions provisional;  // when a new map is confirmed, or discarded and started again
  // Whether a camera that is lost for `lost_time_before_new_map`, and recognizes no map, starts a new map.
  bool new_map_when_lost = false;
  Timestamp lost_time_before_new_map = std::chrono::milliseconds(200);  // image time
  // Gives the key of a map that the system starts by itself, after a discarded one or a loss; 0 when there is
  // none now, then it tries again with the next frame. Must not block. Empty: keys count up from the largest
  // that was used.
  std::function<std::uint64_t()> new_map_key;

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

}  // namespace docent::engine

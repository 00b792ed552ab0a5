// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "engine/system/initialization_monitor.h"
#include "engine/system/system_event.h"

namespace docent::engine {

// In image time.
struct ProvisionalMapOptions {
  // A new map with finite points is provisional until this time has passed or it has this many keyframes.
  Timestamp time = std::chrono::seconds(2);
  std::size_t keyframes = 5;
  // Before that it is discarded and initialized again when tracking is lost for this time, or when
  // InitializationMonitor finds its depth false. A jump proves it false within this time in any case.
  Timestamp loss_time = std::chrono::milliseconds(400);
  // A map without finite points is discarded and started again with the next image when tracking is lost for
  // this time.
  Timestamp panorama_loss_time = std::chrono::milliseconds(150);

  // Describes the first invalid option in one sentence, or empty.
  std::optional<std::string> Validate() const;
};

// Watches a new map until its depth is confirmed, and says when it should be discarded. One for each map; its
// owner guards it.
class ProvisionalMap {
 public:
  // The mapper gave the map finite points. started: time of the last frame.
  void Begin(Timestamp started);
  // The map was confirmed by other means, or it is left.
  void End() { pending_ = is_young_ = false; }
  bool is_pending() const { return pending_; }

  struct Observation {
    const TrackedFrame& frame;
    bool in_map = false;  // the frame's pose is in this map
    const MapSnapshot* map = nullptr;
    std::optional<Timestamp> lost_since = std::nullopt;  // of the frame's camera
    bool may_extend = true;                              // maps are extended at all
    bool may_discard = true;
    bool starting = false;  // the mapper has the two views that give it depth
  };
  // To be called with every frame of a camera that is in the map, by ascending time. Returns why the map
  // should be discarded; empty while it may stay, or may not be discarded.
  std::optional<MapDiscarded> Check(const ProvisionalMapOptions& options, const Observation& seen);

 private:
  InitializationMonitor& MonitorOf(int camera);

  bool pending_ = false;
  Timestamp started_{};
  bool is_young_ = false;                        // Begin was called, and its time has not passed.
  std::vector<InitializationMonitor> monitors_;  // by camera: each sees another part of the map
};

}  // namespace docent::engine

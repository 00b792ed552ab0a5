// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/map/map_snapshot.h"

namespace docent::app {

// A map of the session that no camera is in and that may be adjusted.
struct IdleMap {
  std::uint64_t key = 0;
  std::string name;
  std::shared_ptr<const engine::MapSnapshot> snapshot;
  bool changed = false;  // in this session
};

// Chooses the idle map that needs maintenance most (ptamm §3.1): maps changed in this session first, and
// among these the one with the largest RMS reprojection error. One thread.
class MaintenanceOrder {
 public:
  // Empty when there is none, or when it was interrupted.
  std::optional<IdleMap> Next(const std::vector<IdleMap>& maps, const std::atomic<bool>& interrupt);

 private:
  struct Residual {
    std::uint64_t revision = 0;
    double rms_px = 0;
  };
  std::map<std::uint64_t, Residual> residuals_;  // by key
};

}  // namespace docent::app

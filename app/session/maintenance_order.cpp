// SPDX-License-Identifier: Apache-2.0
#include "app/session/maintenance_order.h"

#include <utility>

#include "maps/maintenance/maintenance.h"

namespace docent::app {

std::optional<IdleMap> MaintenanceOrder::Next(const std::vector<IdleMap>& maps,
                                              const std::atomic<bool>& interrupt) {
  const IdleMap* best = nullptr;
  double best_rms_px = 0;
  for (const IdleMap& map : maps) {
    if (interrupt) return std::nullopt;
    const auto [known, is_new] = residuals_.try_emplace(map.key);
    if (is_new || known->second.revision != map.snapshot->revision)
      known->second = {map.snapshot->revision, maps::ReprojectionRms(*map.snapshot, *map.snapshot)};
    const double rms_px = known->second.rms_px;
    if (best == nullptr || std::pair(map.changed, rms_px) > std::pair(best->changed, best_rms_px)) {
      best = &map;
      best_rms_px = rms_px;
    }
  }
  return best != nullptr ? std::optional(*best) : std::nullopt;
}

}  // namespace docent::app

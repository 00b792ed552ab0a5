// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <vector>

#include "app/session/maintenance_order.h"
#include "app/session/session_state.h"
#include "engine/dense/densification.h"
#include "engine/system/system.h"
#include "maps/library/library.h"

namespace docent::app {

// Maintenance of idle maps (ptamm §3.1: the map maker roves through all maps). It runs on the saver's thread
// of maintenance, and begins while the mapper of the active map is idle. It takes the session's mutex to copy
// what it needs and to enter its result, and works without it.
class IdleMaintenance {
 public:
  // All pointers must outlive this. library is null where nothing is saved; then Run is not called.
  // with_meshes: whether surfaces are computed; with_light: whether also the light on them.
  IdleMaintenance(maps::Library* library, engine::System* system, std::mutex* mutex, SessionState* state,
                  bool with_meshes, bool with_light)
      : library_(library),
        system_(*system),
        mutex_(*mutex),
        state_(*state),
        with_meshes_(with_meshes),
        with_light_(with_light) {}

  // Adjusts the map that needs it most, or computes the surfaces of one that was adjusted, and saves it.
  // Without the session's mutex; ends soon after `interrupt` is set. Returns whether it did something.
  bool Run(const std::atomic<bool>& interrupt);

 private:
  // With the session's mutex held.
  bool IsIdle(const SessionMap& map) const;
  std::vector<IdleMap> MapsToAdjust() const;
  std::optional<IdleMap> MapToMesh() const;
  SessionMap* FindIdleMap(const IdleMap& idle);
  // Without the session's mutex.
  bool Adjust(const IdleMap& chosen, const std::atomic<bool>& interrupt);
  bool ComputeMesh(const IdleMap& chosen, const std::atomic<bool>& interrupt);

  maps::Library* const library_;
  engine::System& system_;
  std::mutex& mutex_;
  SessionState& state_;
  const bool with_meshes_, with_light_;
  // Accessed only by the thread of maintenance.
  MaintenanceOrder order_;
  std::optional<engine::Densification> unfinished_;  // surfaces whose computation was interrupted
};

}  // namespace docent::app

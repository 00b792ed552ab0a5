// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <mutex>

#include "app/script/commands.h"
#include "app/session/map_keys.h"
#include "app/session/session_memory.h"
#include "app/session/session_saving.h"
#include "app/session/session_state.h"
#include "app/session/system_event_handler.h"
#include "engine/system/system.h"
#include "engine/tracking/tracked_frame.h"
#include "maps/library/library.h"

namespace docent::app {

// Executes the commands that concern whole maps: which one a camera is in, their names and policies, and
// saving. Each throws Error with one sentence when it cannot be executed; then nothing has changed. With the
// session's mutex held; a command that takes the lock releases it while the disk works, because the saver's
// thread takes the mutex too, and no frame shall wait for a disk.
class MapCommands {
 public:
  // All pointers must outlive this; library may be null.
  MapCommands(maps::Library* library, MapKeys* keys, engine::System* system, SessionState* state,
              SystemEventHandler* events, SessionMemory* memory, SessionSaving* saving)
      : library_(library),
        keys_(*keys),
        system_(*system),
        state_(*state),
        events_(*events),
        memory_(*memory),
        saving_(*saving) {}

  void Apply(const NewMap& command, const engine::TrackedFrame& frame);
  void Apply(const StopMap& command, const engine::TrackedFrame& frame);
  void Apply(const UseMap& command, const engine::TrackedFrame& frame);
  void Apply(const SetPolicy& command, const engine::TrackedFrame& frame, std::unique_lock<std::mutex>* lock);
  void Apply(const RenameMap& command, const engine::TrackedFrame& frame, std::unique_lock<std::mutex>* lock);
  void Apply(const RemoveMap& command, const engine::TrackedFrame& frame, std::unique_lock<std::mutex>* lock);
  void Apply(const JoinMap& command, const engine::TrackedFrame& frame);
  void Apply(const Save& command, const engine::TrackedFrame& frame);

 private:
  void ChangePolicy(const SetPolicy& command, std::uint64_t key, Timestamp time,
                    std::unique_lock<std::mutex>* lock);

  maps::Library* const library_;
  MapKeys& keys_;
  engine::System& system_;
  SessionState& state_;
  SystemEventHandler& events_;
  SessionMemory& memory_;
  SessionSaving& saving_;
};

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <exception>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "app/session/idle_maintenance.h"
#include "app/session/map_keys.h"
#include "app/session/session_options.h"
#include "app/session/session_state.h"
#include "engine/system/system.h"
#include "maps/library/library.h"
#include "maps/library/saver.h"

namespace docent::app {

// Whether something is not on disk yet, and when something was written last.
struct SavingStatus {
  bool unsaved = false;
  std::optional<std::chrono::steady_clock::time_point> saved_at;  // empty before the first time
};

// Passes what changed in a session to the saver, which writes it in the background and maintains idle maps.
// Until Start is called, nothing is saved and every function does nothing. With the session's mutex held,
// unless stated otherwise.
class SessionSaving {
 public:
  // All pointers must outlive this; library may be null.
  SessionSaving(const SessionOptions& options, maps::Library* library, MapKeys* keys, engine::System* system,
                std::mutex* mutex, SessionState* state)
      : options_(options),
        library_(library),
        keys_(*keys),
        system_(*system),
        mutex_(*mutex),
        state_(*state),
        maintenance_(library, system, mutex, state, options.occlusion == Occlusion::kMap,
                     options.room_light) {}

  // Starts the saver's thread; call it once, with a library opened for writing. Without the mutex.
  void Start();
  bool HasStarted() const { return saver_.has_value(); }

  // What the session has changed in the library without a save is on disk.
  void LibraryWasChanged() {
    if (options_.on_saved) options_.on_saved();
  }

  void SaveMap(SessionMap* map, Timestamp time);
  void SaveAll(Timestamp time);
  // Saves all maps that are not provisional if the interval of the options has passed. Before that, and now
  // and then if the options have none, it reports a save that failed.
  void Autosave(Timestamp time);
  // A failed save becomes a warning, and everything that it may not have written is saved again.
  void ReportFailure(Timestamp time);
  // Waits until the library holds all changes of the map that were submitted, and nothing waits for the disk;
  // returns whether it has the map. Releases the lock meanwhile. Throws Error if the map exists no longer
  // after that.
  bool FlushToLibrary(std::uint64_t key, const std::string& name, Timestamp time,
                      std::unique_lock<std::mutex>* lock);
  // Maintenance gives way, because something else needs its map or its time.
  void InterruptMaintenance();
  // From now on nothing is saved any more. What was saved stays.
  void DiscardChanges() { discards_changes_ = true; }

  // Without the mutex:
  SavingStatus Status() const;
  // Ends maintenance for good, and waits until everything submitted is on disk or has failed.
  void EndMaintenance();
  void Flush();
  // At the end, after SaveAll and Flush: the maps whose last changes are not on disk, as one sentence that
  // follows the reason; empty if there are none.
  std::string DescribeUnsaved() const;
  std::exception_ptr TakeError();  // the first failure since it was last asked; null for none

 private:
  bool AddContent(SessionMap* map, Timestamp time, maps::MapRecord* record);
  void OnSaved(const maps::MapRecord& record);  // on the saver's thread, without the mutex
  bool IsInLibrary(std::uint64_t key) const;

  const SessionOptions& options_;
  maps::Library* const library_;
  MapKeys& keys_;
  engine::System& system_;
  std::mutex& mutex_;  // the session's; guards the members below except the last two
  SessionState& state_;
  std::optional<Timestamp> last_save_;
  std::optional<std::chrono::steady_clock::time_point> saved_at_;  // for people only
  std::set<std::uint64_t>
      submitted_;  // keys of the maps that have not been written since they were submitted or refused
  bool discards_changes_ = false;
  IdleMaintenance maintenance_;       // accessed only by the saver's thread of maintenance
  std::optional<maps::Saver> saver_;  // last, because its thread calls back into the other members
};

}  // namespace docent::app

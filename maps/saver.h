// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>

#include "engine/base/worker.h"
#include "maps/library.h"
#include "maps/map_record.h"

namespace docent::maps {

// Saves maps on a thread of its own, so that nobody who tracks or draws waits for a disk. Requests wait in a
// short queue with one place a map: a newer snapshot or scene of a map takes the place of the older one that
// was not written yet, and what waits of maps that were joined into another one (MapRecord::holds) is
// forgotten. When and how often to save is up to the caller, and so is the upkeep that fills the
// time between: a save interrupts it. Any thread may call. A save that fails does not stop the others; its
// exception waits for TakeError, and nothing that was saved before is lost.
class Saver {
 public:
  using Saved = std::function<void(const MapRecord& record)>;
  // What is done on the saver's thread while nothing waits to be saved. It ends soon after `interrupt` is
  // set, answers whether it did something, and is asked again: at once when it did, else after a while.
  using Upkeep = std::function<bool(const std::atomic<bool>& interrupt)>;
  // library: opened for writing; must outlive the saver. capacity: maps that may wait at once; one more makes
  // Submit wait. saved: told on the saver's thread of each record that is on disk; may be empty.
  explicit Saver(Library* library, std::size_t capacity = 16, Saved saved = {}, Upkeep maintenance = {});
  // Writes what still waits, then ends. Whoever wants to know about failures calls Flush and TakeError first.
  ~Saver();

  void Submit(MapRecord record);
  // Forgets what waits of a map that is to be removed; a save of it that is running is waited for.
  void Forget(std::uint64_t key);
  // Waits until everything submitted before is on disk or has failed.
  void Flush();
  // The first failure since the last call; null when there was none.
  std::exception_ptr TakeError();
  // Maps that wait or are being written.
  std::size_t pending() const;
  // Ends the upkeep that runs now, if any; it goes on later.
  void InterruptMaintenance() { interrupt_ = true; }
  // The same, for good, and waits for it: what it uses may go.
  void EndMaintenance();

 private:
  void Run(const std::stop_token& stop);
  bool Idle() const { return waiting_.empty() && !running_; }
  bool RunMaintenance(std::unique_lock<std::mutex>* lock);

  Library* const library_;
  const std::size_t capacity_;
  const Saved saved_;
  const Upkeep upkeep_;
  std::atomic<bool> interrupt_ = false;
  mutable std::mutex mutex_;  // guards all below; not held during a save
  std::condition_variable_any changed_;
  std::deque<MapRecord> waiting_;
  std::optional<std::uint64_t> running_;  // key
  std::exception_ptr error_;
  bool keeping_up_ = false, upkeep_ended_ = false;
  Worker worker_;  // last: it uses the rest
};

}  // namespace docent::maps

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
#include "maps/library/library.h"
#include "maps/storage/map_record.h"

namespace docent::maps {

// Saves maps on a separate thread, so that tracking and drawing never wait for the disk. Requests wait in a
// short queue with one entry per map: a newer snapshot, scene or estimate of a lens replaces one that is not
// written yet, and entries of maps that were joined into another one (MapRecord::joined_keys) are dropped.
// The caller decides when to save. Maintenance of the library runs on a second thread, which takes little
// processor time from the others (LowerThreadPriority). Thread-safe. A failed save does not stop the others:
// its exception is kept for TakeError, and nothing that was saved before is lost.
class Saver {
 public:
  // Told of each record that is on disk, on the saver's thread.
  using Saved = std::function<void(const MapRecord& record)>;
  // Work for the second thread. It must end soon after `interrupt` is set. It returns whether it did
  // something; if so it is called again at once, else after a while. What it writes must not undo a save
  // meanwhile (MapRecord::expected_revision and expected_scene).
  using Maintenance = std::function<bool(const std::atomic<bool>& interrupt)>;
  // `library` must be opened for writing and outlive the saver. `capacity` is the number of maps that can
  // wait; Submit blocks when the queue is full. `saved` is called on the saver's thread for each record that
  // is on disk; it may be empty.
  explicit Saver(Library* library, std::size_t capacity = 16, Saved saved = {}, Maintenance maintenance = {});
  // Writes what is still waiting, then ends. Call Flush and TakeError first to learn of failures.
  ~Saver();

  // Requests a save. Returns at once unless the queue is full.
  void Submit(MapRecord record);
  // Waits until every earlier request is on disk or has failed.
  void Flush();
  // Returns and clears the first failure since the last call; null if there was none.
  std::exception_ptr TakeError();
  // The number of maps that are waiting or being written.
  std::size_t pending() const;
  // Interrupts the current maintenance, if any; it is resumed later.
  void InterruptMaintenance() { interrupt_ = true; }
  // Ends maintenance permanently and waits for it, so that the objects it uses can be destroyed.
  void EndMaintenance();

 private:
  void SaveUntil(const std::stop_token& stop);
  void MaintainUntil(const std::stop_token& stop);
  bool Idle() const { return waiting_.empty() && !running_; }
  bool RunMaintenance(std::unique_lock<std::mutex>* lock);

  Library* const library_;
  const std::size_t capacity_;
  const Saved saved_;
  const Maintenance maintenance_;
  std::atomic<bool> interrupt_ = false;
  mutable std::mutex mutex_;  // Guards the fields below; not held during a save.
  std::condition_variable_any changed_;
  std::deque<MapRecord> waiting_;
  std::optional<std::uint64_t> running_;  // Key of the map that is being saved.
  std::exception_ptr error_;
  bool maintenance_running_ = false, maintenance_ended_ = false;
  Worker save_worker_;  // Declared last, because they use the other fields.
  std::optional<Worker> maintenance_worker_;
};

}  // namespace docent::maps

// SPDX-License-Identifier: Apache-2.0
#pragma once

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
// was not written yet. When and how often to save is up to the caller. Any thread may call. A save that fails
// does not stop the others; its exception waits for TakeError, and nothing that was saved before is lost.
class Saver {
 public:
  using Saved = std::function<void(const MapRecord& record)>;
  // library: opened for writing; must outlive the saver. capacity: maps that may wait at once; one more makes
  // Submit wait. saved: told on the saver's thread of each record that is on disk; may be empty.
  explicit Saver(Library* library, std::size_t capacity = 16, Saved saved = {});
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

 private:
  void Run(const std::stop_token& stop);
  bool Idle() const { return waiting_.empty() && !running_; }

  Library* const library_;
  const std::size_t capacity_;
  const Saved saved_;
  mutable std::mutex mutex_;  // guards all below; not held during a save
  std::condition_variable_any changed_;
  std::deque<MapRecord> waiting_;
  std::optional<std::uint64_t> running_;  // key
  std::exception_ptr error_;
  Worker worker_;  // last: it uses the rest
};

}  // namespace docent::maps

// SPDX-License-Identifier: Apache-2.0
#include "maps/library/saver.h"

#include <algorithm>
#include <chrono>
#include <utility>
#include <vector>

#include "engine/base/thread_priority.h"

namespace docent::maps {

namespace {

constexpr std::chrono::milliseconds kMaintenanceInterval{250};

// Adds estimates of lenses. A newer one replaces that of the same camera.
void MergeLenses(std::vector<StoredLens> newer, std::vector<StoredLens>* lenses) {
  for (StoredLens& lens : newer) {
    std::erase_if(*lenses, [&](const StoredLens& older) { return older.camera == lens.camera; });
    lenses->push_back(std::move(lens));
  }
}

}  // namespace

Saver::Saver(Library* library, std::size_t capacity, Saved saved, Maintenance maintenance)
    : library_(library),
      capacity_(std::max<std::size_t>(1, capacity)),
      saved_(std::move(saved)),
      maintenance_(std::move(maintenance)),
      save_worker_("map-saver", [this](const std::stop_token& stop) { SaveUntil(stop); }) {
  if (!maintenance_) return;
  maintenance_worker_.emplace("maintenance", [this](const std::stop_token& stop) {
    LowerThreadPriority();
    MaintainUntil(stop);
  });
}

Saver::~Saver() {
  EndMaintenance();
  if (maintenance_worker_) maintenance_worker_->Join();
  save_worker_.RequestStop();  // SaveUntil ends only when no save is waiting.
  save_worker_.Join();
}

void Saver::Submit(MapRecord record) {
  {
    std::unique_lock lock(mutex_);
    // A waiting save of a map that is now part of this one would restore it.
    for (const std::uint64_t gone : record.joined_keys)
      std::erase_if(waiting_, [&](const MapRecord& waiting) { return waiting.key == gone; });
    const auto same_map = [&] {
      return std::find_if(waiting_.begin(), waiting_.end(),
                          [&](const MapRecord& waiting) { return waiting.key == record.key; });
    };
    changed_.wait(lock, [&] { return same_map() != waiting_.end() || waiting_.size() < capacity_; });
    if (const auto place = same_map(); place != waiting_.end()) {
      if (record.snapshot) place->snapshot = std::move(record.snapshot);
      // The history belongs to the scene.
      if (record.scene || record.history) place->history = std::move(record.history);
      if (record.scene) place->scene = std::move(record.scene);
      place->joined_keys.insert(place->joined_keys.end(), record.joined_keys.begin(),
                                record.joined_keys.end());
      MergeLenses(std::move(record.lenses), &place->lenses);
    } else {
      waiting_.push_back(std::move(record));
    }
  }
  changed_.notify_all();
}

void Saver::Flush() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return Idle(); });
}

std::exception_ptr Saver::TakeError() {
  std::scoped_lock lock(mutex_);
  return std::exchange(error_, nullptr);
}

std::size_t Saver::pending() const {
  std::scoped_lock lock(mutex_);
  return waiting_.size() + (running_ ? 1 : 0);
}

void Saver::EndMaintenance() {
  std::unique_lock lock(mutex_);
  maintenance_ended_ = interrupt_ = true;
  changed_.notify_all();
  changed_.wait(lock, [this] { return !maintenance_running_; });
}

// Requires the lock, which is released while the maintenance runs.
bool Saver::RunMaintenance(std::unique_lock<std::mutex>* lock) {
  maintenance_running_ = true;
  interrupt_ = false;
  lock->unlock();
  bool more = false;
  std::exception_ptr error;
  try {
    more = maintenance_(interrupt_);
  } catch (...) {
    error = std::current_exception();
  }
  lock->lock();
  if (!error_) error_ = error;
  maintenance_running_ = false;
  changed_.notify_all();
  return more;
}

void Saver::MaintainUntil(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const auto has_ended = [this] { return maintenance_ended_; };
  bool more = false;
  while (more ? !has_ended() : !changed_.wait_for(lock, stop, kMaintenanceInterval, has_ended)) {
    if (stop.stop_requested()) return;
    more = RunMaintenance(&lock);
  }
}

void Saver::SaveUntil(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  while (true) {
    if (!changed_.wait(lock, stop, [this] { return !waiting_.empty(); })) return;
    MapRecord record = std::move(waiting_.front());
    waiting_.pop_front();
    running_ = record.key;
    lock.unlock();
    changed_.notify_all();
    std::exception_ptr error;
    try {
      library_->Save(record);
      if (saved_) saved_(record);
    } catch (...) {
      error = std::current_exception();
    }
    record = {};  // Large data is released before waiting threads are notified.
    lock.lock();
    if (!error_) error_ = error;
    running_.reset();
    changed_.notify_all();
  }
}

}  // namespace docent::maps

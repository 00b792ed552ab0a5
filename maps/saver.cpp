// SPDX-License-Identifier: Apache-2.0
#include "maps/saver.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace docent::maps {

namespace {

constexpr std::chrono::milliseconds kUntilUpkeepIsAskedAgain{250};

}  // namespace

Saver::Saver(Library* library, std::size_t capacity, Saved saved, Upkeep maintenance)
    : library_(library),
      capacity_(std::max<std::size_t>(1, capacity)),
      saved_(std::move(saved)),
      upkeep_(std::move(maintenance)),
      worker_("map-saver", [this](const std::stop_token& stop) { Run(stop); }) {}

Saver::~Saver() {
  EndMaintenance();
  worker_.RequestStop();  // Run ends only when nothing waits
  worker_.Join();
}

void Saver::Submit(MapRecord record) {
  {
    std::unique_lock lock(mutex_);
    // What waits of a map that is a part of this one now would bring it back.
    for (const std::uint64_t gone : record.holds)
      std::erase_if(waiting_, [&](const MapRecord& waiting) { return waiting.key == gone; });
    const auto same_map = [&] {
      return std::find_if(waiting_.begin(), waiting_.end(),
                          [&](const MapRecord& waiting) { return waiting.key == record.key; });
    };
    changed_.wait(lock, [&] { return same_map() != waiting_.end() || waiting_.size() < capacity_; });
    if (const auto place = same_map(); place != waiting_.end()) {
      if (record.snapshot) place->snapshot = std::move(record.snapshot);
      if (record.scene) place->scene = std::move(record.scene);
      place->holds.insert(place->holds.end(), record.holds.begin(), record.holds.end());
    } else {
      waiting_.push_back(std::move(record));
    }
    interrupt_ = true;
  }
  changed_.notify_all();
}

void Saver::Forget(std::uint64_t key) {
  std::unique_lock lock(mutex_);
  std::erase_if(waiting_, [&](const MapRecord& waiting) { return waiting.key == key; });
  changed_.wait(lock, [&] { return running_ != key; });
  lock.unlock();
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
  upkeep_ended_ = interrupt_ = true;
  changed_.wait(lock, [this] { return !keeping_up_; });
}

// With the lock held, which is let go meanwhile.
bool Saver::RunMaintenance(std::unique_lock<std::mutex>* lock) {
  keeping_up_ = true;
  interrupt_ = false;
  lock->unlock();
  bool more = false;
  std::exception_ptr error;
  try {
    more = upkeep_(interrupt_);
  } catch (...) {
    error = std::current_exception();
  }
  lock->lock();
  if (!error_) error_ = error;
  keeping_up_ = false;
  changed_.notify_all();
  return more;
}

void Saver::Run(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const auto waits = [this] { return !waiting_.empty(); };
  while (true) {
    bool more = false;
    while (upkeep_ && !upkeep_ended_ && !waits()) {
      if (!more &&
          changed_.wait_for(lock, stop, kUntilUpkeepIsAskedAgain, [&] { return waits() || upkeep_ended_; }))
        break;
      if (stop.stop_requested()) break;
      more = RunMaintenance(&lock);
    }
    if (!changed_.wait(lock, stop, waits)) return;
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
    record = {};  // large things are let go before anybody is told
    lock.lock();
    if (!error_) error_ = error;
    running_.reset();
    changed_.notify_all();
  }
}

}  // namespace docent::maps

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>

namespace docent {

// A first-in, first-out queue of limited length between threads. Any number of threads may push and pop at
// the same time. Push waits while the queue is full; this back-pressure limits how far a fast producer runs
// ahead of a slow consumer. A closed queue accepts no more items, wakes all waiting threads, and still
// returns the items that it holds. The lock is held only while an item is moved in or out.
template <typename Item>
class BoundedQueue {
 public:
  // capacity: maximum number of items; 0 counts as 1.
  explicit BoundedQueue(std::size_t capacity) : capacity_(std::max<std::size_t>(1, capacity)) {}
  BoundedQueue(const BoundedQueue&) = delete;
  BoundedQueue& operator=(const BoundedQueue&) = delete;

  // Waits for a free slot. Returns false and drops the item if the queue is closed or `stop` is requested
  // first.
  bool Push(Item item, std::stop_token stop = {}) {
    std::unique_lock lock(mutex_);
    const bool woken = changed_.wait(lock, stop, [this] { return closed_ || items_.size() < capacity_; });
    if (!woken || closed_) return false;
    items_.push_back(std::move(item));
    lock.unlock();
    changed_.notify_all();
    return true;
  }

  // Never waits. Returns false and leaves the item unchanged if the queue is full or closed.
  bool TryPush(Item& item) {
    {
      std::scoped_lock lock(mutex_);
      if (closed_ || items_.size() >= capacity_) return false;
      items_.push_back(std::move(item));
    }
    changed_.notify_all();
    return true;
  }
  bool TryPush(Item&& item) { return TryPush(item); }

  // Waits for an item. Empty if the queue is closed and holds no items, or if `stop` is requested first.
  std::optional<Item> Pop(std::stop_token stop = {}) {
    std::unique_lock lock(mutex_);
    const bool woken = changed_.wait(lock, stop, [this] { return closed_ || !items_.empty(); });
    if (!woken || items_.empty()) return std::nullopt;
    return TakeFront(lock);
  }

  // Never waits. Empty if the queue holds no items.
  std::optional<Item> TryPop() {
    std::unique_lock lock(mutex_);
    if (items_.empty()) return std::nullopt;
    return TakeFront(lock);
  }

  // Accepts no more items from now on. May be called more than once.
  void Close() {
    {
      std::scoped_lock lock(mutex_);
      closed_ = true;
    }
    changed_.notify_all();
  }

  bool closed() const {
    std::scoped_lock lock(mutex_);
    return closed_;
  }
  std::size_t size() const {
    std::scoped_lock lock(mutex_);
    return items_.size();
  }
  std::size_t capacity() const { return capacity_; }

 private:
  std::optional<Item> TakeFront(std::unique_lock<std::mutex>& lock) {
    std::optional<Item> item(std::move(items_.front()));
    items_.pop_front();
    lock.unlock();
    changed_.notify_all();
    return item;
  }

  const std::size_t capacity_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;  // _any, because a stop token can wake it too
  std::deque<Item> items_;
  bool closed_ = false;
};

}  // namespace docent

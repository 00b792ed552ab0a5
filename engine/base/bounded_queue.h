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
// once. A full queue makes Push wait: that is the back-pressure that keeps a fast producer from running away
// from a slow consumer. Once closed it takes nothing more, wakes everybody who waits, and still hands out
// what it holds. The lock is never held while an item is used, only while it is moved in or out.
template <typename Item>
class BoundedQueue {
 public:
  // capacity: items held at most; 0 counts as 1.
  explicit BoundedQueue(std::size_t capacity) : capacity_(std::max<std::size_t>(1, capacity)) {}
  BoundedQueue(const BoundedQueue&) = delete;
  BoundedQueue& operator=(const BoundedQueue&) = delete;

  // Waits for room. False, and the item is dropped, when the queue is closed or `stop` is requested first.
  bool Push(Item item, std::stop_token stop = {}) {
    std::unique_lock lock(mutex_);
    const bool woken = changed_.wait(lock, stop, [this] { return closed_ || items_.size() < capacity_; });
    if (!woken || closed_) return false;
    items_.push_back(std::move(item));
    lock.unlock();
    changed_.notify_all();
    return true;
  }

  // Never waits. False when the queue is full or closed; the item is then left as it was.
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

  // Waits for an item. Empty when the queue is closed and holds nothing, or `stop` is requested first.
  std::optional<Item> Pop(std::stop_token stop = {}) {
    std::unique_lock lock(mutex_);
    const bool woken = changed_.wait(lock, stop, [this] { return closed_ || !items_.empty(); });
    if (!woken || items_.empty()) return std::nullopt;
    return TakeFront(lock);
  }

  // Never waits. Empty when the queue holds nothing.
  std::optional<Item> TryPop() {
    std::unique_lock lock(mutex_);
    if (items_.empty()) return std::nullopt;
    return TakeFront(lock);
  }

  // Takes no more items from now on. May be called more than once.
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
  std::condition_variable_any changed_;  // any, because it can also be woken by a stop token
  std::deque<Item> items_;
  bool closed_ = false;
};

}  // namespace docent

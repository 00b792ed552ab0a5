// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace docent::engine {

// Lends objects, such as the features of an image. When the last owner drops an object, on whatever thread,
// it returns to the pool, and everything that owner did with it happens before the next loan. Once the pool
// is warm, a loan allocates nothing, unlike std::make_shared. Objects may outlive the pool.
//
// One per camera. Take may be called from one thread at a time; objects may be dropped from any thread.
template <typename Object>
class SharedPool {
 public:
  SharedPool() : store_(std::make_shared<Store>()) {}

  // An object with no other owner. Its contents are those of an earlier loan, and their memory can be reused.
  std::shared_ptr<Object> Take() {
    std::unique_ptr<Buffer> buffer = store_->Take();
    if (!buffer) buffer = std::make_unique<Buffer>();
    Buffer* const lent = buffer.release();  // deallocate() owns it from here on
    return std::shared_ptr<Object>(
        &lent->object, [](Object*) {}, ControlBlockMemory<Object>(store_, lent));
  }
  // Number of objects that wait for a loan; at most kMaxFree, because a discarded map returns many at once.
  std::size_t free_buffers() const { return store_->size(); }

  static constexpr std::size_t kMaxFree = 8;

 private:
  // The object and the memory of the control block of the std::shared_ptr that lends it.
  struct Buffer {
    static constexpr std::size_t kControlBlockBytes = 128;
    Object object;
    alignas(std::max_align_t) std::array<std::byte, kControlBlockBytes> control_block;
  };

  class Store {
   public:
    Store() { free_.reserve(kMaxFree); }

    std::unique_ptr<Buffer> Take() {
      const std::scoped_lock lock(mutex_);
      if (free_.empty()) return nullptr;
      std::unique_ptr<Buffer> buffer = std::move(free_.back());
      free_.pop_back();
      return buffer;
    }
    void GiveBack(std::unique_ptr<Buffer> buffer) {
      const std::scoped_lock lock(mutex_);
      if (free_.size() < kMaxFree) free_.push_back(std::move(buffer));
    }
    std::size_t size() const {
      const std::scoped_lock lock(mutex_);
      return free_.size();
    }

   private:
    mutable std::mutex mutex_;
    std::vector<std::unique_ptr<Buffer>> free_;
  };

  // Allocator of the control block. Freeing the control block is the last thing that a std::shared_ptr does,
  // so that the whole buffer is unused then.
  template <typename T>
  class ControlBlockMemory {
   public:
    using value_type = T;

    ControlBlockMemory(std::shared_ptr<Store> store, Buffer* buffer)
        : store_(std::move(store)), buffer_(buffer) {}
    template <typename U>
    ControlBlockMemory(const ControlBlockMemory<U>& other)  // NOLINT(google-explicit-constructor)
        : store_(other.store_), buffer_(other.buffer_) {}

    T* allocate(std::size_t) {
      static_assert(sizeof(T) <= Buffer::kControlBlockBytes && alignof(T) <= alignof(std::max_align_t));
      return reinterpret_cast<T*>(buffer_->control_block.data());
    }
    void deallocate(T*, std::size_t) noexcept { store_->GiveBack(std::unique_ptr<Buffer>(buffer_)); }

    template <typename U>
    bool operator==(const ControlBlockMemory<U>& other) const {
      return buffer_ == other.buffer_;
    }

   private:
    template <typename U>
    friend class ControlBlockMemory;

    std::shared_ptr<Store> store_;  // a buffer may outlive the pool
    Buffer* buffer_;
  };

  std::shared_ptr<Store> store_;
};

}  // namespace docent::engine

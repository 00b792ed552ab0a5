// SPDX-License-Identifier: Apache-2.0
#include "engine/tracking/feature_pool.h"

#include <array>
#include <mutex>
#include <utility>
#include <vector>

namespace docent::engine {

// The features and the memory of the control block of the std::shared_ptr that lends them.
struct FeaturePool::Buffer {
  static constexpr std::size_t kControlBlockBytes = 128;
  ImageFeatures features;
  alignas(std::max_align_t) std::array<std::byte, kControlBlockBytes> control_block;
};

class FeaturePool::Store {
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

// Allocator of the control block. Freeing the control block is the last thing that a std::shared_ptr does, so
// that the whole buffer is unused then.
template <typename T>
class FeaturePool::ControlBlockMemory {
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

FeaturePool::FeaturePool() : store_(std::make_shared<Store>()) {}

FeaturePool::~FeaturePool() = default;

FeaturePool::FeaturePool(FeaturePool&&) noexcept = default;

std::shared_ptr<ImageFeatures> FeaturePool::Take() {
  std::unique_ptr<Buffer> buffer = store_->Take();
  if (!buffer) buffer = std::make_unique<Buffer>();
  Buffer* const lent = buffer.release();  // deallocate() owns it from here on
  return std::shared_ptr<ImageFeatures>(
      &lent->features, [](ImageFeatures*) {}, ControlBlockMemory<ImageFeatures>(store_, lent));
}

std::size_t FeaturePool::free_buffers() const {
  return store_->size();
}

}  // namespace docent::engine

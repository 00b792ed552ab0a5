// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>

#include "engine/vision/image_pyramid.h"

namespace docent::engine {

// Lends the memory that holds the features of an image. When the last owner drops a buffer, on whatever
// thread, it returns to the pool, and everything that owner did with it happens before the next loan. Once
// the pool is warm, a loan allocates nothing, unlike std::make_shared. Buffers may outlive the pool.
//
// One per camera. Take may be called from one thread at a time; buffers may be dropped from any thread.
class FeaturePool {
 public:
  FeaturePool();
  ~FeaturePool();
  FeaturePool(FeaturePool&&) noexcept;

  // A buffer with no other owner. Its contents are those of an earlier loan, and their memory can be reused.
  std::shared_ptr<ImageFeatures> Take();
  // Number of buffers that wait for a loan; at most kMaxFree, because a discarded map returns many at once.
  std::size_t free_buffers() const;

  static constexpr std::size_t kMaxFree = 8;

 private:
  struct Buffer;
  class Store;
  template <typename T>
  class ControlBlockMemory;

  std::shared_ptr<Store> store_;
};

}  // namespace docent::engine

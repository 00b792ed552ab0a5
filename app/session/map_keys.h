// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>

#include "maps/library/library.h"

namespace docent::app {

// Keys for new maps. A library gives them out once, which takes a transaction on disk; so they are reserved
// in advance, and taking one does not wait for the disk. Any thread.
class MapKeys {
 public:
  // library null: keys count up from 1.
  explicit MapKeys(maps::Library* library);

  // A new key. Without reserved ones left it asks the library, and throws docent::Error if that fails.
  std::uint64_t Take();
  // A new key without waiting for the disk; 0 when no reserved one is left.
  std::uint64_t TryTake();
  // Reserves keys when few are left. It waits for the disk, so it does not belong on a camera's thread; a
  // failure is left to Take.
  void Refill();

 private:
  // A session that starts more maps than this between two saves is not expected.
  static constexpr std::size_t kReserved = 64;

  maps::Library* const library_;
  std::mutex mutex_;
  std::deque<std::uint64_t> reserved_;
  std::uint64_t next_ = 1;  // without a library
};

}  // namespace docent::app

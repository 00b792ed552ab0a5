// SPDX-License-Identifier: Apache-2.0
#include "app/session/map_keys.h"

#include "engine/base/error.h"

namespace docent::app {

MapKeys::MapKeys(maps::Library* library) : library_(library) {
  Refill();
}

std::uint64_t MapKeys::Take() {
  const std::uint64_t key = TryTake();
  return key != 0 ? key : library_->ReserveKeys(1);
}

std::uint64_t MapKeys::TryTake() {
  const std::scoped_lock lock(mutex_);
  if (library_ == nullptr) return next_++;
  if (reserved_.empty()) return 0;
  const std::uint64_t key = reserved_.front();
  reserved_.pop_front();
  return key;
}

void MapKeys::Refill() {
  if (library_ == nullptr) return;
  {
    const std::scoped_lock lock(mutex_);
    if (reserved_.size() > kReserved / 2) return;
  }
  try {
    const std::uint64_t first = library_->ReserveKeys(kReserved);
    const std::scoped_lock lock(mutex_);
    for (std::size_t i = 0; i < kReserved; ++i) reserved_.push_back(first + i);
  } catch (const Error&) {
    // A full disk: the next save reports it, and Take tries again when the last key is used.
  }
}

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

namespace docent {

// Whether a flag asks long work to end soon; null never does.
inline bool IsInterrupted(const std::atomic<bool>* interrupt) {
  return interrupt != nullptr && interrupt->load(std::memory_order_relaxed);
}

}  // namespace docent

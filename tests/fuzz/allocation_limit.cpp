// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/allocation_limit.h"

#include <sanitizer/allocator_interface.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <limits>

namespace {

std::atomic<std::size_t> max_allocation = std::numeric_limits<std::size_t>::max();

void OnMalloc(const volatile void*, std::size_t size) {
  if (size <= max_allocation) return;
  max_allocation = std::numeric_limits<std::size_t>::max();
  constexpr char kMessage[] = "an allocation exceeds the limit for this input\n";
  if (write(STDERR_FILENO, kMessage, sizeof(kMessage) - 1) > 0) std::abort();
  std::abort();
}

void OnFree(const volatile void*) {}

}  // namespace

AllocationLimit::AllocationLimit(std::size_t bytes) {
  static const int installed = __sanitizer_install_malloc_and_free_hooks(OnMalloc, OnFree);
  if (installed == 0) std::abort();
  max_allocation = bytes;
}

AllocationLimit::~AllocationLimit() {
  max_allocation = std::numeric_limits<std::size_t>::max();
}

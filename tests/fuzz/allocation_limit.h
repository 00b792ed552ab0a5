// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

// While an object exists, any single allocation larger than `bytes`, in any thread, aborts the program with a
// message, which the fuzzer reports as a crash. Only one object may exist at a time. Requires the address
// sanitizer.
class AllocationLimit {
 public:
  explicit AllocationLimit(std::size_t bytes);
  ~AllocationLimit();
  AllocationLimit(const AllocationLimit&) = delete;
  AllocationLimit& operator=(const AllocationLimit&) = delete;
};

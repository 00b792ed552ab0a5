// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

// No single allocation may be larger than what is read justifies: while one exists, a larger one ends the
// program with a message, which the fuzzer keeps as a crash. All threads; one at a time. Needs the address
// sanitizer.
class AllocationLimit {
 public:
  explicit AllocationLimit(std::size_t bytes);
  ~AllocationLimit();
  AllocationLimit(const AllocationLimit&) = delete;
  AllocationLimit& operator=(const AllocationLimit&) = delete;
};

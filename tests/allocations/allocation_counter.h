// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

// Counts what this thread takes from the heap, by whatever way: the program's malloc, which operator new,
// OpenCV and Eigen end in, is replaced by one that counts and then does what the C library's does.
namespace docent::testing_allocations {

// Since the thread began.
std::size_t AllocationsOfThisThread();

}  // namespace docent::testing_allocations

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

// Counts the heap allocations of this thread. The program's malloc, which operator new, OpenCV and Eigen
// call, is replaced by one that counts and then calls the C library's.
namespace docent::testing_allocations {

// The number of allocations since the thread began.
std::size_t AllocationsOfThisThread();

}  // namespace docent::testing_allocations

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <vector>

namespace docent::engine {

// std::stable_sort for short lists of elements that are aligned to more than 16 bytes, as those with Eigen's
// matrices and quaternions are. The buffer of GCC's std::stable_sort is aligned for fundamental types only,
// so that vector instructions may fault there. Sorts by insertion and does not allocate.
template <typename T, typename Less>
void StableSort(std::vector<T>* elements, const Less& less) {
  const auto begin = elements->begin();
  for (auto next = begin; next != elements->end(); ++next)
    std::rotate(std::upper_bound(begin, next, *next, less), next, next + 1);
}

}  // namespace docent::engine

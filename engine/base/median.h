// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace docent {

// The element in the middle of the sorted values, the upper one of the two if their number is even;
// `if_empty` without values.
inline double Median(std::vector<double> values, double if_empty = 0) {
  if (values.empty()) return if_empty;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace docent

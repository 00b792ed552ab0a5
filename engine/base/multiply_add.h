// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

namespace docent {

// a b + c, rounded once on targets that compute it in one instruction, twice on others; as Eigen's matrix
// products are.
inline double MultiplyAdd(double a, double b, double c) {
#ifdef FP_FAST_FMA
  return std::fma(a, b, c);
#else
  return a * b + c;
#endif
}

}  // namespace docent

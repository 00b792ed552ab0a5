// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace docent {

// Time of an image in integer nanoseconds on its source's own clock. Integers compare exactly.
using Timestamp = std::chrono::nanoseconds;

inline double ToSeconds(std::chrono::nanoseconds time) {
  return std::chrono::duration<double>(time).count();
}

// Rounds to the nearest nanosecond.
inline Timestamp FromSeconds(double seconds) {
  return std::chrono::round<Timestamp>(std::chrono::duration<double>(seconds));
}

}  // namespace docent

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <time.h>

namespace docent {

// CPU time of the calling thread in seconds, which other threads and processes do not distort.
inline double ProcessorSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace docent

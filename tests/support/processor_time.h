// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ctime>

namespace docent {

// The time for which processors have worked for this process, all its threads together. Unlike the time that
// passes, it hardly depends on what else the machine does.
inline double ProcessorTime_s() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace docent

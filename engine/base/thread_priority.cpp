// SPDX-License-Identifier: Apache-2.0
#include "engine/base/thread_priority.h"

#include <sys/resource.h>
#include <unistd.h>

namespace docent {

void LowerThreadPriority() {
  // Five steps of niceness: Linux divides the share of a thread by 1.25 with each.
  constexpr int kSteps = 5;
  const auto thread = static_cast<id_t>(gettid());
  const int now = getpriority(PRIO_PROCESS, thread);
  setpriority(PRIO_PROCESS, thread, now + kSteps);
}

}  // namespace docent

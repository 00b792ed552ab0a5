// SPDX-License-Identifier: Apache-2.0
#include "app/session/pace.h"

namespace docent::app {

const char* ToString(Pace pace) {
  switch (pace) {
    case Pace::kLockstep:
      return "lockstep";
    case Pace::kEager:
      return "eager";
    case Pace::kRealtime:
      return "realtime";
  }
  return "unknown";
}

}  // namespace docent::app

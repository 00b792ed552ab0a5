// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/options.h"

namespace docent::app {

const char* ToString(EngineKind engine) {
  return engine == EngineKind::kHybrid ? "hybrid" : "sixdof";
}

Pace ResolvePace(const RunArguments& run, bool any_live) {
  if (run.pace) return *run.pace;
  return any_live || !run.headless ? Pace::kRealtime : Pace::kEager;
}

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace docent::app {

// How the images of a recording are paced.
enum class Pace {
  kLockstep,  // Tracker and mapper alternate on one thread; results are byte-identical between runs.
  kEager,     // Tracker and mapper run in parallel; no frame is dropped.
  kRealtime,  // Tracker and mapper run in parallel; frames that are late by their timestamps are dropped.
};
const char* ToString(Pace pace);

}  // namespace docent::app

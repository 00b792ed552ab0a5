// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/interruption.h"

#include <atomic>
#include <csignal>

namespace docent::app {

namespace {

std::atomic<bool> g_requested = false;
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may only use lock-free atomics");

void OnSignal(int signal) {
  g_requested = true;
  std::signal(signal, SIG_DFL);
}

}  // namespace

Interruption::Interruption() {
  g_requested = false;
  std::signal(SIGINT, OnSignal);
  std::signal(SIGTERM, OnSignal);
}

Interruption::~Interruption() {
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGTERM, SIG_DFL);
}

bool Interruption::requested() {
  return g_requested;
}

}  // namespace docent::app

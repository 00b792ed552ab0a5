// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/interruption.h"

#include <time.h>

#include <array>
#include <atomic>
#include <csignal>
#include <cstdint>

namespace docent::app {

namespace {

std::atomic<bool> g_requested = false;
std::atomic<std::int64_t> g_repeats_ns = 0;
// When the first SIGINT and the first SIGTERM came; 0 before that.
std::array<std::atomic<std::int64_t>, 2> g_first_ns = {};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<std::int64_t>::is_always_lock_free,
              "a signal handler may only use lock-free atomics");

void OnSignal(int signal) {
  g_requested = true;
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  const std::int64_t now_ns = std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
  std::int64_t first_ns = 0;
  if (g_first_ns[signal == SIGINT ? 0 : 1].compare_exchange_strong(first_ns, now_ns)) return;
  if (now_ns - first_ns < g_repeats_ns) return;
  std::signal(signal, SIG_DFL);
  std::raise(signal);  // It ends the program when this handler returns.
}

}  // namespace

Interruption::Interruption(std::chrono::milliseconds repeats) {
  g_requested = false;
  g_repeats_ns = std::chrono::nanoseconds(repeats).count();
  for (auto& first : g_first_ns) first = 0;
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

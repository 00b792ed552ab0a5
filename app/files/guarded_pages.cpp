// SPDX-License-Identifier: Apache-2.0
#include "app/files/guarded_pages.h"

#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <mutex>

namespace docent::app {

namespace {

// The handler reads the table at any moment, so that it has no lock: a range counts while `begin` is not 0.
struct GuardedRange {
  std::atomic<std::uintptr_t> begin{0};
  std::atomic<std::uintptr_t> end{0};
};
static_assert(std::atomic<std::uintptr_t>::is_always_lock_free);

std::array<GuardedRange, GuardedPages::kMost> guarded_ranges;
std::atomic<std::uint64_t> lost_pages{0};
std::mutex slots_mutex;  // Guards next_slot, and who takes which slot.
std::size_t next_slot = 0;
struct sigaction action_before;
std::uintptr_t page_bytes = 4096;  // Set before the handler is installed.

bool IsInTable(std::uintptr_t address) {
  for (const GuardedRange& range : guarded_ranges) {
    const std::uintptr_t begin = range.begin.load(std::memory_order_acquire);
    if (begin != 0 && address >= begin && address < range.end.load(std::memory_order_acquire)) return true;
  }
  return false;
}

// In the handler of a signal: system calls and atomics only.
void OnBusError(int /*signal*/, siginfo_t* info, void* /*context*/) {
  const int error = errno;
  const auto address = reinterpret_cast<std::uintptr_t>(info->si_addr);
  if (info->si_code != SI_USER && IsInTable(address)) {
    void* const page = reinterpret_cast<void*>(address / page_bytes * page_bytes);
    const void* const zeros =
        ::mmap(page, page_bytes, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0);
    if (zeros != MAP_FAILED) {
      lost_pages.fetch_add(1, std::memory_order_relaxed);
      errno = error;
      return;  // The access is repeated.
    }
  }
  // The access is repeated, and ends the program as if there were no handler.
  ::sigaction(SIGBUS, &action_before, nullptr);
  errno = error;
}

void InstallHandler() {
  static std::once_flag once;
  std::call_once(once, [] {
    page_bytes = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
    struct sigaction action {};
    action.sa_sigaction = OnBusError;
    action.sa_flags = SA_SIGINFO | SA_NODEFER;
    ::sigemptyset(&action.sa_mask);
    ::sigaction(SIGBUS, &action, &action_before);
  });
}

}  // namespace

GuardedPages::GuardedPages(const void* begin, std::size_t bytes) {
  InstallHandler();
  const std::scoped_lock lock(slots_mutex);
  for (std::size_t tried = 0; tried < kMost; ++tried) {
    const std::size_t slot = next_slot;
    next_slot = (next_slot + 1) % kMost;
    GuardedRange& range = guarded_ranges[slot];
    if (range.begin.load(std::memory_order_relaxed) != 0) continue;
    const auto first = reinterpret_cast<std::uintptr_t>(begin);
    range.end.store(first + bytes, std::memory_order_release);
    range.begin.store(first, std::memory_order_release);
    slot_ = slot;
    return;
  }
}

GuardedPages::~GuardedPages() {
  const std::scoped_lock lock(slots_mutex);
  if (slot_) guarded_ranges[*slot_].begin.store(0, std::memory_order_release);
}

std::uint64_t GuardedPages::Lost() {
  return lost_pages.load(std::memory_order_relaxed);
}

bool GuardedPages::IsGuarded(const void* address) {
  return IsInTable(reinterpret_cast<std::uintptr_t>(address));
}

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

namespace docent::app {

// Keeps the program alive when the disk cannot return a page of a mapped file, which the system reports by
// the signal SIGBUS: while this object lives, such a page of its range reads as zeros from then on, and Lost
// counts it. The range is whole pages that are mapped for reading only, and stays mapped while the object
// lives. Up to kMost ranges are guarded at a time; a fault beyond them, or elsewhere, ends the program as
// without this.
//
// Any thread. Making the first object installs the signal's handler for the rest of the program. Neither
// construction nor destruction waits for a disk.
class GuardedPages {
 public:
  static constexpr std::size_t kMost = 16384;  // As many keyframes as 40 large maps have.

  GuardedPages(const void* begin, std::size_t bytes);
  ~GuardedPages();
  GuardedPages(const GuardedPages&) = delete;
  GuardedPages& operator=(const GuardedPages&) = delete;

  // How many pages were replaced by zeros since the program began.
  static std::uint64_t Lost();
  // Whether a fault at this address would be survived.
  static bool IsGuarded(const void* address);

 private:
  std::optional<std::size_t> slot_;  // In the table of ranges; empty if that was full.
};

}  // namespace docent::app

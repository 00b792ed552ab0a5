// SPDX-License-Identifier: Apache-2.0
#include "app/command_line/progress.h"

#include <unistd.h>

#include <cstdio>
#include <utility>

namespace docent::app {

Progress::Progress(std::string what, std::optional<std::uint64_t> total, Verbosity verbosity)
    : what_(std::move(what)),
      total_(total),
      shown_(verbosity != Verbosity::kQuiet && isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() {
  if (drawn_) std::fputs("\r\x1b[K", stderr);
}

void Progress::Update(std::uint64_t done) {
  if (!shown_) return;
  const auto now = std::chrono::steady_clock::now();
  if (drawn_ && now - last_ < std::chrono::milliseconds(200)) return;
  last_ = now;
  drawn_ = true;
  const std::string of_total = total_ ? " of " + std::to_string(*total_) : std::string();
  std::fprintf(stderr, "\r\x1b[K%s: %llu%s", what_.c_str(), static_cast<unsigned long long>(done),
               of_total.c_str());
}

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "app/command_line/options.h"

namespace docent::app {

// Progress line of a long task on standard error. It is redrawn at most five times a second and erased at the
// end. Nothing is printed when standard error is not a terminal or with --quiet. One thread at a time.
class Progress {
 public:
  // `what` names the counted items in a word or two; `total` is empty when it is unknown.
  Progress(std::string what, std::optional<std::uint64_t> total, Verbosity verbosity);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void Update(std::uint64_t done);

 private:
  std::string what_;
  std::optional<std::uint64_t> total_;
  bool shown_ = false;
  bool drawn_ = false;
  std::chrono::steady_clock::time_point last_;
};

}  // namespace docent::app

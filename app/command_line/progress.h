// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "app/command_line/options.h"

namespace docent::app {

// How far long work has come, on a terminal: one line on standard error, drawn again a few times a second and
// wiped away at the end. Silent when standard error is no terminal or the person asked for quiet. One thread.
class Progress {
 public:
  // `what` is a word or two; total is empty where it is not known.
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

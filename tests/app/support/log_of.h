// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <sstream>
#include <string>

namespace docent::app {

// What is logged while the call runs, wherever the program logs to otherwise.
template <typename Call>
std::string LogOf(const Call& call) {
  std::ostringstream text;
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(
      std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::ostream_sink_mt>(text)));
  call();
  spdlog::set_default_logger(before);
  return text.str();
}

}  // namespace docent::app

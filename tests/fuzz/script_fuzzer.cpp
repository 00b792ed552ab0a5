// SPDX-License-Identifier: Apache-2.0
// Parses any bytes as a script: the result must be a docent::Error, or valid commands that are unchanged
// after formatting and parsing them again.
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "app/script/format_command.h"
#include "app/script/script_file.h"
#include "engine/base/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<docent::app::TimedCommand> commands;
  try {
    commands = docent::app::ParseScript({reinterpret_cast<const char*>(data), size}, "fuzz");
  } catch (const docent::Error&) {
    return 0;
  }
  std::string text;
  for (const auto& command : commands) {
    if (!docent::app::Validate(command.command).empty()) __builtin_trap();
    text += docent::app::FormatScriptLine(command) + "\n";
  }
  const auto again = docent::app::ParseScript(text, "again");  // an Error here is a finding
  if (again.size() != commands.size()) __builtin_trap();
  for (std::size_t i = 0; i < again.size(); ++i) {
    if (again[i].command != commands[i].command || again[i].time != commands[i].time) __builtin_trap();
  }
  return 0;
}

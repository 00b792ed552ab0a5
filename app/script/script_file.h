// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "app/script/commands.h"

// Reads commands in the text form that docs/scripts.md describes; format_command.h writes it. A script has
// one command per line, with its time in seconds from the first frame.
namespace docent::app {

// Times must not decrease, and every command must be valid (Validate). Throws Error with file and line.
std::vector<TimedCommand> ReadScript(const std::filesystem::path& path);
std::vector<TimedCommand> ParseScript(std::string_view text, const std::string& name);

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "app/script/commands.h"

// The one text form of commands, which docs/scripts.md describes: its parser and its formatter. A script has
// one command per line, with its time in seconds from the first frame.
namespace docent::app {

// Times must not decrease, and every command must be valid (Validate). Throws Error with file and line.
std::vector<TimedCommand> ReadScript(const std::filesystem::path& path);
std::vector<TimedCommand> ParseScript(std::string_view text, const std::string& name);

// Formats a command without and with its time. If the command is valid, ParseScript returns an equal one.
std::string FormatCommand(const Command& command);
std::string FormatScriptLine(const TimedCommand& command);

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "app/script/commands.h"

// Writes commands in the text form that docs/scripts.md describes; script_file.h reads it. Pure functions.
namespace docent::app {

// Formats a command without and with its time. If the command is valid, ParseScript returns an equal one.
std::string FormatCommand(const Command& command);
std::string FormatScriptLine(const TimedCommand& command);

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "app/script/commands.h"

// Command scripts: one command per line, with its time in seconds from the first frame, as in `12.5 map new
// "Desk 3"`; '#' begins a comment. A word that contains blanks, quotes or '#' is put in double quotes, in
// which \" is a quote, \\ a backslash and \n a line break. Besides the commands of command-line.md:
//   move NAME X Y Z           by this offset in map units along the map's axes
//   move NAME to pixel U V    to the surface visible at that pixel
//   rotate NAME DEG           about its own up axis
//   scale NAME FACTOR
//   remove NAME
namespace docent::app {

// Times must not decrease. Throws Error with file and line.
std::vector<TimedCommand> ReadScript(const std::filesystem::path& path);
std::vector<TimedCommand> ParseScript(std::string_view text, const std::string& name);

// Formats a command without and with its time; ParseScript returns an equal command.
std::string FormatCommand(const Command& command);
std::string FormatScriptLine(const TimedCommand& command);

}  // namespace docent::app

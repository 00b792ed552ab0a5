// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "app/script/commands.h"

// Scripts of commands: one a line, at a time in seconds from the first frame, as in `12.5 map new "Desk 3"`;
// '#' begins a comment. A word with blanks, quotes or '#' in it stands in double quotes, where \" is a quote,
// \\ a backslash and \n a new line. Besides the commands of command-line.md:
//   move NAME X Y Z           by so many metres along the map's axes
//   move NAME to pixel U V    to the surface seen there
//   rotate NAME DEG           about its own up axis
//   scale NAME FACTOR
//   remove NAME
namespace docent::app {

// Times must not decrease. Throws Error with file and line.
std::vector<TimedCommand> ReadScript(const std::filesystem::path& path);
std::vector<TimedCommand> ParseScript(std::string_view text, const std::string& name);

// One command without its time, and a line with it; ParseScript gives an equal command back.
std::string FormatCommand(const Command& command);
std::string FormatScriptLine(const TimedCommand& command);

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "app/script/commands.h"

namespace docent::app {

// What a command has done, for the person who gave it: "Placed fox.glb."
std::string DoneText(const Command& command);
// While a file is read.
std::string ReadingText(const std::string& file);
// Whether undo takes the command back.
bool CanBeUndone(const Command& command);

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/command_line/program.h"

namespace docent::app {

// Adds the subcommands of `maps` that work on whole maps: export, import, optimize, join and recover.
void AddMapsExchangeCommands(CLI::App* group, Invocation* invocation);

}  // namespace docent::app

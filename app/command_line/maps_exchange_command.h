// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/command_line/program.h"

namespace docent::app {

// The subcommands of `maps` that work on a map as a whole: export, import, optimize, join, recover.
void AddMapsExchangeCommands(CLI::App* group, Invocation* invocation);

}  // namespace docent::app

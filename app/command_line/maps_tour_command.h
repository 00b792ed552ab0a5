// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/command_line/program.h"

namespace docent::app {

// Adds the commands that manage the tours of a library, as `docent maps tour`, to the group `maps`.
void AddMapsTourCommands(CLI::App* group, Invocation* invocation);

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/command_line/program.h"

namespace docent::app {

// Adds `docent content edit`, which carries out the commands of scripts (docs/scripts.md) on the content of a
// saved map.
void AddContentEditCommand(CLI::App* group, Invocation* invocation);

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/command_line/program.h"

namespace docent::app {

// `docent maps push|pull`.
void AddMapsHubCommands(CLI::App* group, Invocation* invocation);

}  // namespace docent::app

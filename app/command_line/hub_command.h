// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "app/command_line/program.h"

namespace CLI {
class Option;
}

namespace docent::app {

// `docent hub init|status|revert|backup|restore|hand-in|collect|user`.
void AddHubCommand(CLI::App* program, Invocation* invocation);
// The option --hub of a command; `hub` gets the address.
CLI::Option* AddHubOption(CLI::App* command, std::string* hub);

}  // namespace docent::app

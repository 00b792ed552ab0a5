// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "app/command_line/program.h"

namespace docent::app {

// Adds `docent content add`, which puts a model, image, sound, signpost, label, trail or occluder into a
// saved map.
void AddContentAddCommand(CLI::App* group, Invocation* invocation);

}  // namespace docent::app

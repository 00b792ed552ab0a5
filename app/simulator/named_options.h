// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "app/simulator/simulation.h"

namespace docent::app {

// Named options of the simulator. The same names are used after a scene's name
// ("room,rolling-shutter=20,interlaced") and as options of `docent simulate`.
struct NamedOption {
  const char* name;
  const char* unit;     // Unit of the value, for the help; null for a switch, which has no value.
  const char* meaning;  // Description for the help, one phrase.
  double lowest = 0, highest = 0;
  void (*set)(double value, SimulationOptions* options);  // A switch is set with 1.
  bool whole = false;                                     // Accepts whole numbers only.
};
std::span<const NamedOption> NamedOptions();

// Sets one option. The text must be empty for a switch. Throws docent::Error with one sentence when the text
// is not a number or is outside of the option's range.
void SetNamedOption(const NamedOption& option, std::string_view text, SimulationOptions* options);

// Sets all options of "NAME=NUMBER,NAME,...". Throws docent::Error with one sentence for an unknown name (and
// lists the valid ones), a repeated name, and a missing or invalid number.
void SetNamedOptions(std::string_view text, SimulationOptions* options);

}  // namespace docent::app

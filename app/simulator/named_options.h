// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "app/simulator/simulation.h"

namespace docent::app {

// Options of the simulator by name, the same after a scene's name ("room,rolling-shutter=20,interlaced") as
// behind the dashes of `docent simulate`.
struct NamedOption {
  const char* name;
  const char* unit;     // of its number, for people; null for a switch, which has none
  const char* meaning;  // one phrase
  double lowest = 0, highest = 0;
  void (*set)(double value, SimulationOptions* options);  // a switch is set with 1
  bool whole = false;                                     // takes whole numbers alone
};
std::span<const NamedOption> NamedOptions();

// Sets one of them. Throws docent::Error with one sentence when the text is no number or lies outside the
// option's range. For a switch the text is empty.
void SetNamedOption(const NamedOption& option, std::string_view text, SimulationOptions* options);

// Sets all of "NAME=NUMBER,NAME,...". Throws docent::Error with one sentence for a name that there is not (it
// lists those that there are), one that stands twice, and a number that is missing or wrong.
void SetNamedOptions(std::string_view text, SimulationOptions* options);

}  // namespace docent::app

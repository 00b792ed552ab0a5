// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "app/simulator/simulation.h"
#include "tests/support/error_of.h"

namespace docent::app {

// The message with which the simulator refuses a scene; empty if it makes the scene.
inline std::string ErrorOfScene(const std::string& scene, const SimulationOptions& options = {}) {
  return ErrorOf([&] { MakeSimulation(scene, options); });
}

}  // namespace docent::app

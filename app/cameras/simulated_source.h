// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "app/cameras/frame_source.h"
#include "app/simulator/simulation.h"

namespace docent::app {

// The simulator as a camera: `scene` is what follows "sim:", as MakeSimulation takes it. The source comes
// with the simulation's calibration. Throws Error for an unknown scene or option.
std::unique_ptr<FrameSource> OpenSimulation(const std::string& scene, const CameraOptions& options = {});

// The same over a simulation that somebody else asks for the truth.
std::unique_ptr<FrameSource> OpenSimulation(std::shared_ptr<const Simulation> simulation);

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "app/cameras/frame_source.h"
#include "app/simulator/simulation.h"

namespace docent::app {

// Opens the simulator as a camera. `scene` is the text after "sim:", see MakeSimulation. The source provides
// the simulation's calibration. Throws Error for an unknown scene or option.
std::unique_ptr<FrameSource> OpenSimulation(const std::string& scene, const CameraOptions& options = {});

// Opens an existing simulation, whose ground truth the caller can use.
std::unique_ptr<FrameSource> OpenSimulation(std::shared_ptr<const Simulation> simulation);

}  // namespace docent::app

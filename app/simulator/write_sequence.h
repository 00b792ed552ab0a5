// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>

#include "app/simulator/simulation.h"

namespace docent::app {

// Writes a whole simulation as a sequence in TUM layout (rgb/*.png, rgb.txt, groundtruth.txt with camera to
// world, calibration.yaml, segments.txt). Where the calibration has an error, true_calibration.yaml has the
// lens as it is. The folder must not exist or be empty; otherwise, and when anything cannot be written,
// throws docent::Error, and a folder that could not be finished is taken away again. progress (may be empty):
// called after each image with how many are written, of how many.
void WriteSequence(const Simulation& simulation, const std::filesystem::path& folder,
                   const std::function<void(int written, int total)>& progress = {});

}  // namespace docent::app

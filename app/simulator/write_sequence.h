// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>

#include "app/simulator/simulation.h"

namespace docent::app {

// Writes a simulation as a sequence in TUM layout: rgb/*.png, rgb.txt, groundtruth.txt (camera to world),
// calibration.yaml and segments.txt. If the calibration has an error, true_calibration.yaml has the true
// lens. The folder must not exist or must be empty. Throws docent::Error otherwise, and when a file cannot be
// written; the incomplete sequence is then removed. progress (may be empty) is called after each image with
// the number of written images and the total.
void WriteSequence(const Simulation& simulation, const std::filesystem::path& folder,
                   const std::function<void(int written, int total)>& progress = {});

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "app/evaluation/ground_truth.h"
#include "app/simulator/simulation.h"

// What a simulation knows of itself, in the form in which recorded sequences bring it.
namespace docent::app {

std::vector<TimedPose> GroundTruthOf(const Simulation& simulation);
std::vector<TimedLabel> SegmentsOf(const Simulation& simulation);

}  // namespace docent::app

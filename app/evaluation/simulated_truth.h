// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "app/evaluation/ground_truth.h"
#include "app/simulator/simulation.h"

// Ground truth and segments of a simulation in the same form as those of recorded sequences.
namespace docent::app {

std::vector<TimedPose> GroundTruthOf(const Simulation& simulation);
std::vector<TimedLabel> SegmentsOf(const Simulation& simulation);

}  // namespace docent::app

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "app/evaluation/run_distribution.h"

namespace docent::app {

// The part of report.html about one distribution: a table of its figures, plots of them over the runs, and a
// table of the runs.
std::string DistributionSection(const RunDistribution& distribution);

// Inline SVG of one figure of every run, sorted from the worst to the best; empty where no run has it.
std::string SortedPlot(const RunDistribution& distribution, const Figure& figure);

}  // namespace docent::app

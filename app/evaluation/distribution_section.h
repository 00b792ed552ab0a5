// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "app/evaluation/run_distribution.h"

namespace docent::app {

// The section of report.html about one distribution: a table of its figures, plots over the runs, and a table
// of the runs.
std::string DistributionSection(const RunDistribution& distribution);

// Inline SVG of one figure for all runs, sorted from worst to best; empty when no run has the figure.
std::string SortedPlot(const RunDistribution& distribution, const Figure& figure);

}  // namespace docent::app

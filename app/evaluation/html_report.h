// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/evaluation/evaluated_run.h"
#include "app/evaluation/run_distribution.h"

namespace docent::app {

// Formats report.html: one self-contained page with embedded plots. Compared runs are shown side by side.
std::string FormatHtmlReport(const std::vector<EvaluatedRun>& runs);
void WriteHtmlReport(const std::filesystem::path& path, const std::vector<EvaluatedRun>& runs);

// Formats report.html for many runs: for each distribution a table of its figures, plots of the figures of
// all runs from worst to best, and a table of the runs.
std::string FormatHtmlReport(const std::vector<RunDistribution>& distributions);
void WriteHtmlReport(const std::filesystem::path& path, const std::vector<RunDistribution>& distributions);

}  // namespace docent::app

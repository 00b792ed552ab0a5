// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "app/evaluation/evaluated_run.h"
#include "app/evaluation/run_distribution.h"

namespace docent::app {

// report.html: one page for people with its plots inside; it loads nothing from anywhere. Runs
// that are compared stand side by side.
std::string FormatHtmlReport(const std::vector<EvaluatedRun>& runs);
void WriteHtmlReport(const std::filesystem::path& path, const std::vector<EvaluatedRun>& runs);

// The same of many runs: for each distribution the table of its figures, the figures of every run from the
// worst to the best, and a table of the runs.
std::string FormatHtmlReport(const std::vector<RunDistribution>& distributions);
void WriteHtmlReport(const std::filesystem::path& path, const std::vector<RunDistribution>& distributions);

}  // namespace docent::app
